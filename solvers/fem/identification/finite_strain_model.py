"""The finger at finite strain as a function of its parameters."""

from collections.abc import Sequence

import numpy as np

from geometry.arrays import FloatArray
from geometry.errors import UserError
from solvers.elasticity import Lame, lame_derivatives
from solvers.fem.finite_strain.constraints import LoadState
from solvers.fem.finite_strain.load_path import LoadPath
from solvers.fem.finite_strain.solver import FemNonlinearSolver
from solvers.fem.identification.parameters import problem_with
from solvers.fem.identification.response import Response
from solvers.lagrange import LagrangeSpace
from solvers.problem import Problem
from solvers.solver import silent

PARAMETERS = ("position", "stroke_u", "stroke_v", "poisson", "young")
"""Parameters that can be found at finite strain."""

SOLVER = FemNonlinearSolver(tolerance=1e-10)
"""The criteria of load steps and Newton's method: derivatives need an exact equilibrium."""


class FiniteStrainModel:
    """Responses of a finger at finite strain to a `mean` or `point` load; each starts from the last one.

    Args:
        problem: With the values of everything else.
        space: The elements.
        names: The parameters, of `PARAMETERS`.
    """

    def __init__(self, problem: Problem, space: LagrangeSpace, names: Sequence[str]) -> None:
        self._problem, self.space, self._names = problem, space, tuple(names)
        self._path: LoadPath | None = None
        self._last: tuple[FloatArray, Response] | None = None

    def close(self) -> None:
        """Free what PETSc holds."""
        if self._path is not None:
            self._path.close()

    def response(self, values: FloatArray) -> Response:
        """The response at parameters of shape (p,).

        Raises:
            UserError: If there is no equilibrium.
        """
        problem = problem_with(self._problem, dict(zip(self._names, map(float, values), strict=True)))
        point = self._continued(problem, values)
        if point is None:
            self.close()
            point = self._from_rest(problem)
        response = self._with_slopes(problem, point)
        self._last = values.copy(), response
        return response

    def _continued(self, problem: Problem, values: FloatArray) -> LoadState | None:
        """From the last response, along its derivatives."""
        if self._path is None or self._last is None:
            return None
        before, last = self._last
        step = values - before
        nodal = last.nodal + np.einsum("p,pnx->nx", step, last.nodal_slopes)
        return self._path.continued(problem, nodal, last.forces + step @ last.force_slopes)

    def _from_rest(self, problem: Problem) -> LoadState:
        self._path = SOLVER.path(problem, self.space)
        self._path.follow(silent)
        last = self._path.points[-1]
        if last.fraction < 1:
            raise UserError(
                f"fem-id found no equilibrium beyond {last.fraction:.0%} of the load "
                f"{problem.load.displacement} mm; "
                "take a smaller prior or model=fem"
            )
        return last

    def _with_slopes(self, problem: Problem, point: LoadState) -> Response:
        path = self._path
        if path is None:
            raise RuntimeError("there is no path to an equilibrium yet")
        equilibrium, nodal, moduli = path.equilibrium, point.nodal, problem.material.lame
        equilibrium.factorise(point)
        return Response.of(
            problem,
            self.space,
            self._names,
            (nodal, point.forces, equilibrium.energy(nodal)),
            equilibrium.factors.solve,
            equilibrium.elimination,
            lambda name: equilibrium.force_slope(nodal, moduli, _moduli_slope(name, problem)),
        )


def _moduli_slope(name: str, problem: Problem) -> Lame:
    """Derivatives of λ and μ by a parameter."""
    material = problem.material
    if name == "poisson":
        return lame_derivatives(material.young, material.poisson, material.plane)
    if name == "young":
        return Lame(*(value / material.young for value in material.lame))
    return Lame(0.0, 0.0, 0.0)
