"""Response of the finger and its derivatives by the parameters, at an equilibrium.

With the internal force F, the functionals b_k of the load and their values d_k the equilibrium is
F(c, θ) = f_k b_k(θ), b_k(θ) . c = d_k(θ). With the tangent K there, the derivative by a parameter, written ',
costs one back-substitution:

    K c' - f_k' b_k = f_k b_k' - dF/dθ,   b_k . c' = d_k' - b_k' . c
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from geometry.arrays import FloatArray
from solvers.constrained_elimination import ConstrainedElimination
from solvers.lagrange import LagrangeSpace
from solvers.problem import Problem, contact_functional


@dataclass(frozen=True, eq=False)
class Response:
    """Displacements and forces, and their derivatives by p parameters.

    Attributes:
        nodal: Displacements, shape (N, 2), mm.
        forces: At the prescribed components, shape (k,), N/mm.
        nodal_slopes: Shape (p, N, 2).
        force_slopes: Shape (p, k).
        energy: Elastic energy of the body per depth, N mm / mm; without that of a layer at the base.
    """

    nodal: FloatArray
    forces: FloatArray
    nodal_slopes: FloatArray
    force_slopes: FloatArray
    energy: float

    @classmethod
    def of(
        cls,
        problem: Problem,
        space: LagrangeSpace,
        names: Sequence[str],
        equilibrium: tuple[FloatArray, FloatArray, float],
        solve: Callable[[FloatArray], FloatArray],
        load: ConstrainedElimination,
        force_slope: Callable[[str], FloatArray],
    ) -> "Response":
        """Solve once for each parameter.

        Args:
            problem: With the values of the parameters.
            space: The elements.
            names: The parameters.
            equilibrium: `nodal`, `forces` and `energy`.
            solve: K^-1 of nodal forces, shape (N, 2).
            load: The load's functionals b_k.
            force_slope: From a parameter to dF/dθ, shape (N, 2).
        """
        nodal, forces, energy = equilibrium
        slopes = []
        for name in names:
            moved = _moved_functionals(name, problem, space)
            free = solve(np.tensordot(forces, moved, axes=1) - force_slope(name))
            target = np.array([float(name == f"stroke_{'uv'[axis]}") for axis in problem.load.prescribed])
            slopes.append(load.solution(free, target - np.tensordot(moved, nodal)))
        return cls(
            nodal,
            forces,
            np.array([slope for slope, _ in slopes]).reshape(-1, *nodal.shape),
            np.array([slope for _, slope in slopes]).reshape(-1, len(forces)),
            energy,
        )


def _moved_functionals(name: str, problem: Problem, space: LagrangeSpace) -> FloatArray:
    """Derivatives of `load_functionals` by a parameter, shape (k, N, 2).

    The weight moves with the contact: by its position, the mean of the displacement over it changes by the
    mean of du/dx.
    """
    slopes = np.zeros((len(problem.load.prescribed), len(space.nodes), 2))
    if name == "position":
        points, weights = contact_functional(problem)
        along = space.shape_gradients(problem.mesh.locate(points))[0].T @ weights
        for row, axis in enumerate(problem.load.prescribed):
            slopes[row, :, axis] = along
    return slopes
