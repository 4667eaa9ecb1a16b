"""References: solutions on graded elements at fixed points, with bounds of their errors; kept in small files.

`python -m benchmarks references` makes them again.
"""

from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from pinnray.comparison.evaluation.differences import relative_l2
from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.solution import Solution
from pinnray.studies.benchmark.problems import BenchmarkProblem

STEPS = 65_535
MEASURES = ("displacement", "von_mises", "von_mises_away", "force", "energy")


@dataclass(frozen=True, eq=False)
class Sampled:
    """Displacement (n, 2), mm, von Mises stress (n,), MPa, force, N, and energy, N mm/mm."""

    displacement: FloatArray
    von_mises: FloatArray
    force: float
    energy: float

    @classmethod
    def of(cls, solution: Solution, points: FloatArray) -> Self:
        """A solution at points (n, 2), mm."""
        mesh = solution.problem.mesh
        location = mesh.locate_on(mesh, points)  # which may lie beyond its chords of arcs
        von_mises = solution.state(location).von_mises
        return cls(solution.displacement(location), von_mises, solution.force, float(solution.energy))


@dataclass(frozen=True, eq=False)
class Reference:
    """The solution of a problem at n points, and by how much it may be off."""

    points: FloatArray  #: Shape (n, 2), mm
    weights: FloatArray  #: Shape (n,), mm²
    away: BoolArray  #: Whether a point is a wall's thickness away from corners and contact, shape (n,)
    exact: Sampled
    bounds: dict[str, float] = field(default_factory=dict)  #: Relative error by `MEASURES`

    def errors(self, found: Sampled) -> dict[str, float]:
        """Relative errors by `MEASURES`: L2 norms over the body, force and energy with their signs."""
        return {
            "displacement": relative_l2(found.displacement, self.exact.displacement, self.weights),
            "von_mises": relative_l2(found.von_mises, self.exact.von_mises, self.weights),
            "von_mises_away": relative_l2(
                *(values[self.away] for values in (found.von_mises, self.exact.von_mises, self.weights))
            ),
            "force": found.force / self.exact.force - 1,
            "energy": found.energy / self.exact.energy - 1,
        }

    @classmethod
    def load(cls, problem: BenchmarkProblem) -> Self:
        """The one of a problem.

        Raises:
            UserError: If its file is missing or damaged.
        """
        file = problem.reference_file
        try:
            with np.load(file, allow_pickle=False) as stored:
                arrays = dict(stored)
        except (OSError, ValueError) as error:
            raise UserError(f"the reference {file} cannot be read: {error}") from None
        points, u, von_mises = (
            unpacked(arrays[name], arrays[f"{name}_range"]) for name in ("points", "u", "von_mises")
        )
        force, energy, *bounds = map(float, arrays["numbers"])
        away = np.unpackbits(arrays["away"], count=len(points)).astype(bool)
        exact = Sampled(u, von_mises, force, energy)
        weights = arrays["weights"].astype(np.float64)
        return cls(points, weights, away, exact, dict(zip(MEASURES, bounds, strict=True)))


def unpacked(steps: NDArray[np.uint16], ends: FloatArray) -> FloatArray:
    """Values from whole steps of the range between two ends."""
    low, high = ends
    return np.asarray(low + steps * ((high - low) / STEPS))
