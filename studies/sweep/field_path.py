"""A finger's deformation along its load path, on a mesh that moves with the finger's walls."""

import json
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Self

import numpy as np
from scipy.interpolate import CubicSpline

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.design_motion import MovingMesh
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.atomic import write_arrays
from pinnray.runtime.errors import UserError
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.lagrange import LagrangeField
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import Solver

NUMBERS = ("force_u", "force_v", "energy", "force_abscissa", "contact_width")
"""Of a body along its load path: force on it, N/mm, energy, N mm/mm, and where it is pressed, mm."""


@dataclass(frozen=True, eq=False)
class FieldPath:
    """Displacements of the nodes of quadratic elements at k equal strokes up to the full one.

    Attributes:
        nodal: Shape (k, N, 2), mm.
        numbers: Values of `NUMBERS`, shape (k, 5).
    """

    nodal: FloatArray
    numbers: FloatArray

    @classmethod
    def of(cls, solution: Solution, strokes: int) -> Self:
        """The path of a solution whose load grew from rest to the full one.

        Between two equilibria of which none is at the stroke, a cubic spline in the load is taken.
        """
        history = solution.history
        nodal = [state.values for state in solution.states if isinstance(state, LagrangeField)]
        columns = ("reaction_x", "reaction_y", "energy", "force_abscissa_mm", "contact_width_mm")
        known = [history.get(name, np.zeros(len(nodal))) for name in columns]
        spline = CubicSpline(history["load_fraction"], np.array(nodal).reshape(len(nodal), -1))
        shares = np.arange(1, strokes + 1) / strokes
        return cls(
            spline(shares).reshape(strokes, -1, 2),
            np.column_stack([np.interp(shares, history["load_fraction"], column) for column in known]),
        )

    def save(self, file: Path) -> None:
        """Write the path atomically; displacements in single precision, of which seven digits are enough."""
        write_arrays(file, {"nodal": self.nodal.astype(np.float32), "numbers": self.numbers})

    @classmethod
    def load(cls, file: Path) -> Self:
        """The path in a file.

        Raises:
            UserError: If it is damaged.
        """
        try:
            with np.load(file, allow_pickle=False) as arrays:
                return cls(arrays["nodal"].astype(np.float64), arrays["numbers"])
        except (OSError, ValueError, KeyError) as error:
            raise UserError(f"{file} is damaged ({error}); remove it and run the sweep again") from None


def stepping(solver: Solver, strokes: int) -> Solver:
    """The solver of finite strain with its load steps at equal strokes, where it needs no shorter ones."""
    assert isinstance(solver, FemNonlinearSolver)
    step, stops = 1 / strokes, tuple(number / strokes for number in range(1, strokes + 1))
    smallest = min(step, solver.min_step)
    return replace(solver, first_step=step, max_step=step, min_step=smallest, stops=stops)


@lru_cache(maxsize=1)
def moving_mesh(base: str, settings: MeshSettings) -> MovingMesh:
    """The mesh of a base finger, whose definition is given as JSON, to be moved; the last one is kept."""
    finger = Design(**json.loads(base))
    return MovingMesh(finger_mesh(finger, settings=settings), finger)
