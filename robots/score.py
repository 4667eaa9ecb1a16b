"""Score of a robot model: its shapes and forces against finite elements, at loads that no fit has seen."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pinnray.robots.chain import MM
from pinnray.robots.presses import Press, PressedFinger
from pinnray.robots.simulation import Model, Rest, pressed_in_mujoco
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.tables import Cell


@dataclass(frozen=True, eq=False)
class ScoredPress:
    """One load with both answers."""

    load: Press
    found: Rest

    @property
    def shape_error(self) -> float:
        """Mean distance of the front's points from the finite elements', mm."""
        return float(np.linalg.norm(self.found.moved - self.load.moved, axis=1).mean())

    @property
    def motion(self) -> float:
        """Mean displacement of the front's points by finite elements, mm."""
        return float(np.linalg.norm(self.load.moved, axis=1).mean())

    @property
    def force_error(self) -> float:
        """Force along the stroke over the finite elements', less one."""
        return float(self.found.force[1] / self.load.force[1] - 1)

    def row(self) -> dict[str, Cell]:
        """A line of the table in files."""
        (fem_x, fem_y), (x, y) = self.load.force, self.found.force
        return {
            "place_mm": self.load.place,
            "stroke_mm": self.load.travel,
            "motion_mm": self.motion,
            "shape_error_mm": self.shape_error,
            "fem_force_N": float(-fem_y),
            "force_N": float(-y),
            "force_error_percent": 100 * self.force_error,
            "fem_tangential_force_N": float(fem_x),
            "tangential_force_N": float(x),
            "steady": self.found.steady,
        }


@dataclass(frozen=True, eq=False)
class ModelScore:
    """Errors of a model at all loads."""

    model: str
    presses: tuple[ScoredPress, ...]

    @property
    def steady(self) -> bool:
        """Whether every load came to rest."""
        return all(each.found.steady for each in self.presses)

    def values(self) -> dict[str, float]:
        """Means over the loads: of the errors' sizes, of the motion, and of the computing time."""
        force = np.abs([each.force_error for each in self.presses])
        shape = [each.shape_error for each in self.presses]
        return {
            "shape_error_mm": float(np.mean(shape)),
            "largest_shape_error_mm": float(np.max(shape)),
            "motion_mm": float(np.mean([each.motion for each in self.presses])),
            "force_error_percent": float(100 * force.mean()),
            "largest_force_error_percent": float(100 * force.max()),
            "computing_s_per_s": float(np.mean([each.found.seconds for each in self.presses])),
        }

    @property
    def sentence(self) -> str:
        """The means in words."""
        of = self.values()
        return (
            f"mean over {len(self.presses)} loads that the fit has not seen: front off by "
            f"{of['shape_error_mm']:.2g} mm of {of['motion_mm']:.2g} mm (largest "
            f"{of['largest_shape_error_mm']:.2g} mm), force by {of['force_error_percent']:.2g} % (largest "
            f"{of['largest_force_error_percent']:.2g} %); {of['computing_s_per_s']:.2g} CPU s a second"
        )

    def document(self) -> Mapping[str, Any]:
        """Everything, for JSON."""
        return {**self.values(), "steady": self.steady, "loads": [each.row() for each in self.presses]}


def scored(model: Model, finger: PressedFinger, loads: Sequence[Press]) -> ModelScore:
    """Press a model under loads and compare with the finite elements."""
    rest: FloatArray = MM * finger.front
    depth = finger.problem.mesh.depth
    found = (pressed_in_mujoco(model, load, finger.radius, depth, rest) for load in loads)
    return ModelScore(model.name, tuple(ScoredPress(*pair) for pair in zip(loads, found, strict=True)))
