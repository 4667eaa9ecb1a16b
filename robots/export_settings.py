"""The settings of an export to robot simulators."""

from typing import Literal, get_args

from pydantic import Field

from pinnray.geometry.finger.parameters import CheckedModel, bounded

Kind = Literal["mujoco", "mesh"]
KINDS: tuple[Kind, ...] = get_args(Kind)


class ExportSettings(CheckedModel):
    """What is exported, and how."""

    hinges: int = bounded(12, 2, 60, "Number of hinges of the chain")
    loss_factor: float = bounded(0.2, 0.001, 2, "Damping of the material, which is stated and not fitted")
    across: int = bounded(
        1, 1, 8, "Least number of tetrahedra through a wall: more are less stiff, and slower"
    )
    layers: int = bounded(1, 1, 40, "Layers of tetrahedra through the depth")
    places: int = bounded(6, 2, 20, "Number of places of the cylinder for the fit")
    score: bool = Field(
        default=False,
        description="Press the models of mujoco at ten loads that the fit has not seen, and compare with "
        "fem-nonlinear",
    )
