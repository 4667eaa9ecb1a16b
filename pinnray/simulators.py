"""Function of the front door for robot simulators: export."""

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Unpack

from pinnray.arguments import JobKeywords, mesh_settings, read_job
from pinnray.geometry.finger.finger import Finger
from pinnray.runtime.errors import UserError
from pinnray.runtime.text_files import as_path
from pinnray.solvers.physics import Load, LoadKind, Material

if TYPE_CHECKING:
    from pinnray.robots.export import Exported


def export(
    kind: Literal["mujoco", "sofa", "mesh"],
    design: str | Path | Finger = "default",
    *,
    out: str | Path,
    hinges: int = 12,
    loss_factor: float = 0.2,
    across: int = 1,
    layers: int = 1,
    places: int = 6,
    score: bool = False,
    size: float | None = None,
    material: Material | str | None = None,
    load: Load | LoadKind | None = "cylinder",
    progress: bool | None = None,
    **given: Unpack[JobKeywords],
) -> "Exported":
    """Write a finger for a robot simulator, in SI units: `export("mujoco", out="model", score=True)`.

    Warns of loads that `fem-nonlinear` did not reach, and of a scene that nobody has run.

    Args:
        kind: `mujoco`: a chain of hinges and a flexible body, both fitted to `fem-nonlinear` under a cylinder
            at several places, up to the stroke; `sofa`: a scene and its mesh; `mesh`: tetrahedra, their
            surface, and the material.
        design: A finger in one of the ways of `mesh`.
        out: Output folder.
        hinges: Number of hinges of the chain.
        loss_factor: Damping of the material, which is stated and not fitted.
        across: Least number of tetrahedra through a wall.
        layers: Layers of tetrahedra through the depth.
        places: Number of places of the cylinder for the fit.
        score: Whether to press the models of `mujoco` at loads that the fit has not seen.
        size: Largest element of `fem-nonlinear` in walls and ribs, mm; 1 if None.
        material: See `solve`.
        load: See `solve`; a cylinder.
        progress: Whether to show the stages; if None in a notebook only.
        given: Parameters of finger, material and load.

    Raises:
        UserError: If MuJoCo is missing, a load is not possible, or the finger is of several materials.
    """
    from pinnray.geometry.cache import finger_mesh, mesh_sizes
    from pinnray.robots.export import KINDS, SIZES, ExportSettings, export_finger
    from pinnray.runtime.stages import shown_stages
    from pinnray.solvers.problem import Problem

    if kind not in KINDS:
        raise UserError(f"there is no export {kind!r}; there are {', '.join(KINDS)}")
    settings = ExportSettings(
        hinges=hinges, loss_factor=loss_factor, across=across, layers=layers, places=places, score=score
    )
    finger, elastic, moved = read_job(design, material, load, given, besides=("size", "material", "load"))
    with shown_stages(progress) as stages:
        with stages.stage("mesh"):
            triangles = finger_mesh(finger, settings=mesh_sizes(finger, mesh_settings(size), SIZES))
        problem = Problem(triangles, elastic, moved, None, finger)
        done = export_finger(kind, problem, as_path(out, "out"), settings, stages)
    for remark in done.remarks:
        warnings.warn(remark, stacklevel=2)
    return done
