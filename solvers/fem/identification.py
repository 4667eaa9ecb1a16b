"""`fem-id`: contact, walls and law from the markers, by finite elements at finite strain with moved walls."""

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar, Literal

import numpy as np
import ufl

from pinnray.geometry.drawing.drawn_finger import DrawnFinger
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.geometry.mesh.quadrature import body_quadrature
from pinnray.geometry.observations import Observations
from pinnray.geometry.picture_frame import Registration
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.assimilation.estimation import COST_CHANGE
from pinnray.solvers.elasticity import Lame, deformation_jacobian, energy_density_of
from pinnray.solvers.fem.boundary_conditions import dirichlet_conditions
from pinnray.solvers.fem.dolfinx_compat import DolfinxSpace, NodeFunction
from pinnray.solvers.fem.equilibrium import QUADRATURE_DEGREE
from pinnray.solvers.fem.factorisation import Factorisation
from pinnray.solvers.fem.finite_strain.nested_path import coarser
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.fem.thick_body import ThickBody
from pinnray.solvers.identification.body import Body, Linearised
from pinnray.solvers.identification.cylinder_model import CylinderModel
from pinnray.solvers.identification.fit import Fit
from pinnray.solvers.identification.model import Response, ResponseModel
from pinnray.solvers.identification.nested_search import ROUGHLY, NestedSearch, identified
from pinnray.solvers.identification.search import Identifier
from pinnray.solvers.identification.settings import IdentifyingSolver
from pinnray.solvers.identification.unknowns import Unknowns
from pinnray.solvers.lagrange import LagrangeField, LagrangeSpace
from pinnray.solvers.problem import Load, Problem
from pinnray.solvers.solution import Solution, Status
from pinnray.solvers.solver import Cost, Family, Progress, check_problem, silent


class FemBody:
    """Lagrange elements of degree 1 or 2 on the drawn mesh; see `pinnray.solvers.identification.body.Body`.

    A state is the array of nodal displacements, shape (N, 2), mm.
    """

    thick: ClassVar[bool] = False

    def __init__(self, unknowns: Unknowns, degree: int) -> None:
        problem, motion = unknowns.problem, unknowns.motion
        space = LagrangeSpace(problem.mesh, degree)
        self.space, self._motion = space, motion
        self._elements = DolfinxSpace(space)
        self._clamped, _ = dirichlet_conditions(Problem(problem.mesh, problem.material, Load()), space)
        self.shape = self._clamped.shape
        rule = body_quadrature(problem.mesh, QUADRATURE_DEGREE)
        self._derivatives = space.shape_gradients(rule.location)
        self._wall_gradients = motion.gradients[:, rule.location.cells]
        moduli = self._elements.moduli(problem.material.lame)
        self._moduli: tuple[Any, Any] = moduli[:2]
        self._moved, self._direction = (self._elements.node_function() for _ in range(2))
        shift = ufl.Identity(2) + ufl.grad(self._moved.function)
        gradient = ufl.dot(ufl.grad(self._elements.function), ufl.inv(shift))
        density = energy_density_of(problem.material.law, gradient, moduli, ufl.ln)
        energy = density * ufl.det(shift) * ufl.dx(metadata={"quadrature_degree": QUADRATURE_DEGREE})
        self._energy = self._elements.form(energy)
        self._force, self._tangent = self._elements.derivatives(energy)
        function, self._base_motion = self._elements.function, self._elements.node_function(degree)
        force = ufl.derivative(energy, function, ufl.TestFunction(function.function_space))
        slope = ufl.derivative(force, self._moved.function, self._direction.function)
        by_base = ufl.derivative(force, function, self._base_motion.function)
        self._wall_slope, self._base_slope = map(self._elements.form, (slope, by_base))
        at_base = self._clamped.all(axis=1)
        self.feet = np.zeros((len(unknowns.feet.names), *self.shape))
        self.feet[:, at_base] = unknowns.feet.motions(space.nodes[at_base])
        front = np.setdiff1d(space.boundary_nodes("front"), space.boundary_nodes("base"))
        self.front = space.nodes[front]
        self._conditions = self._elements.clamp(self._clamped)
        self._factors: Factorisation | None = None
        self._sampled: dict[bytes, LocatedPoints] = {}

    def admissible(self, state: FloatArray, changes: FloatArray) -> bool:
        """At the quadrature points; see `Body`."""
        walls = np.einsum("k,kqij->qij", changes, self._wall_gradients)
        gradient = np.stack([derivative @ state for derivative in self._derivatives], axis=-1)
        inside_out = (deformation_jacobian(walls) <= 0) | (deformation_jacobian(gradient + walls) <= 0)
        return bool(np.isfinite(state).all() and not inside_out.any())

    def linearised(self, state: FloatArray, lame: Lame, changes: FloatArray) -> Linearised | None:
        """Assemble and factorise at a state; see `Body`."""
        if not self.admissible(state, changes):
            return None
        self._set(state, lame, changes)
        force = np.where(self._clamped, 0.0, self._elements.assemble_nodal(self._force))
        try:
            factors = self._factorised()
        except UserError:  # a singular tangent
            return None
        return Linearised(force, factors.solve_all, lambda: factors.negative)

    def _factorised(self) -> Factorisation:
        """Factors of the tangent at the state that was set last."""
        if self._factors is None:
            matrix = self._elements.assemble_matrix(self._tangent, self._conditions)
            self._factors = Factorisation(self._elements, matrix, self._clamped, positive_definite=False)
        else:
            self._elements.assemble_matrix(self._tangent, self._conditions, into=self._factors.matrix)
            self._factors.update()
        return self._factors

    def force_slopes(
        self, state: FloatArray, lame: Lame, changes: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """By the walls, the moduli and the base, in all of which it is a form; see `Body`."""
        self._set(state, lame, changes)
        of_walls = self._slopes(self._wall_slope, self._direction, self._motion.nodal)
        of_feet = self._slopes(self._base_slope, self._base_motion, self.feet)
        of_moduli = np.zeros((2, *self.shape))
        for found, unit in zip(of_moduli, np.eye(2), strict=True):
            self._set_moduli(unit)
            found[:] = self._elements.assemble_nodal(self._force)
        self._set_moduli(lame[:2])
        return of_walls, of_moduli, of_feet

    def _slopes(self, form: Any, direction: NodeFunction, nodal: FloatArray) -> FloatArray:
        """Derivatives of F (k, *shape), a form, in directions whose nodal values have the shape (k, n, 2)."""
        found = np.zeros((len(nodal), *self.shape))
        for slope, values in zip(found, nodal, strict=True):
            direction.set(values)
            slope[:] = self._elements.assemble_nodal(form)
        return found

    def displacement_rows(self, points: FloatArray, weights: FloatArray) -> FloatArray:
        """From the shape functions; see `Body`."""
        return _both_components(weights @ self.space.shape_functions(self._located(points)))

    traction_rows = displacement_rows

    def gradient_rows(self, points: FloatArray, weights: FloatArray) -> FloatArray:
        """From the derivatives of the shape functions; see `Body`."""
        along = self.space.shape_gradients(self._located(points))
        return _both_components(sum(weights[..., axis] @ along[axis] for axis in range(2)))

    def energy(self, state: FloatArray, lame: Lame, changes: FloatArray) -> float:
        """By quadrature; see `Body`."""
        self._set(state, lame, changes)
        return self._elements.assemble_scalar(self._energy)

    def field(self, state: FloatArray) -> LagrangeField:
        """The finite-element field."""
        return LagrangeField(self.space, state)

    def displacements(self, states: FloatArray, location: LocatedPoints) -> FloatArray:
        """Displacements (s, n, 2) of states (s, N, 2) at points of the drawn body."""
        columns = np.concatenate(list(states), axis=1)
        found: FloatArray = (self.space.shape_functions(location) @ columns).reshape(-1, len(states), 2)
        return found.swapaxes(0, 1)

    def gradients(self, states: FloatArray, location: LocatedPoints) -> FloatArray:
        """Displacement gradients (s, n, 2, 2) of states (s, N, 2) at points of the drawn body."""
        columns = np.concatenate(list(states), axis=1)
        by_axis = [each @ columns for each in self.space.shape_gradients(location)]
        found: FloatArray = np.stack(by_axis, axis=-1).reshape(len(location.points), len(states), 2, 2)
        return found.swapaxes(0, 1)

    def _set(self, state: FloatArray, lame: Lame, changes: FloatArray) -> None:
        self._elements.set_function(state)
        self._moved.set(np.einsum("k,knx->nx", changes, self._motion.nodal))
        self._set_moduli(lame[:2])

    def _set_moduli(self, values: Iterable[float]) -> None:
        for constant, value in zip(self._moduli, values, strict=True):
            constant.value = value

    def _located(self, points: FloatArray) -> LocatedPoints:
        key = points.tobytes()
        if key not in self._sampled:
            self._sampled[key] = self.space.mesh.locate(points)
        return self._sampled[key]


def _both_components(values: FloatArray) -> FloatArray:
    """Rows (r, 2, N, 2) of both components from rows (r, N) of one."""
    return np.asarray(np.einsum("rn,ab->ranb", np.asarray(values), np.eye(2)))


@dataclass(frozen=True, kw_only=True)
class FemIdSolver(IdentifyingSolver):
    """Finite elements whose contact, walls and law are found from the markers.

    Markers of a real finger are on a side face, which bulges; those of most simulated ones are in plane
    strain. Both are fitted and weighed by the markers; the side face by a `ThickBody`, on elements of 1 mm
    where the mesh has finer ones. With `sides="plane"`, or where a drawing has no depth, only plane strain
    is, and intervals have the doubt of that.
    """

    degree: int = 2  # Of the elements, 1 or 2
    sides: Literal["weighed", "plane"] = "weighed"  # Whether free side faces are weighed against the plane
    name: ClassVar[str] = "fem-id"
    family: ClassVar[Family] = "finite elements"
    laws: ClassVar[tuple[str, ...]] = FemNonlinearSolver.laws
    cost: ClassVar[Cost] = Cost(per_triangle=275)

    def __post_init__(self) -> None:
        if self.degree not in (1, 2):
            raise UserError(f"fem-id has elements of degree 1 and 2, not {self.degree}")
        super().__post_init__()

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Find the unknowns and solve with them; see `Solver`. Without markers it is `fem-nonlinear`."""
        check_problem(self, problem)
        if problem.observations is None:
            plain = FemNonlinearSolver(degree=self.degree).solve(problem, progress)
            said = f"without markers, this is fem-nonlinear: {plain.status.message}"
            return replace(plain, solver=self.name, status=Status(plain.status.converged, said))
        found = self.refitter(problem)(problem.observations, progress)
        progress(1.0, found.force_phrase)
        return found

    def refitter(self, problem: Problem) -> Callable[..., Solution]:
        """A function that finds the unknowns for other observations; see `Refittable`.

        Fits share the elements; each search starts from the last result. It takes a progress, too. On a fine
        mesh the unknowns are sought on a coarse one first.
        """
        kept: dict[tuple[Registration, Registration], list[NestedSearch]] = {}

        def fitted(observations: Observations, progress: Progress = silent) -> Solution:
            started, frames = time.perf_counter(), (observations.pressed, observations.drawn)
            if frames not in kept:
                own = replace(problem, observations=observations)
                sought = [self.unknowns]
                if problem.load.kind == "cylinder":
                    sought.insert(0, self.under_cylinder)
                kept[frames] = [self._search(own, names) for names in sought]
            found = identified(kept[frames], observations, progress)
            stats = {
                "seconds": time.perf_counter() - started,
                "unknowns": found.best.response.state.size,
                "triangles": len(found.best.model.unknowns.problem.mesh.triangles),
                "degree": self.degree,
            }
            return found.solution(self.name, replace(problem, observations=observations), stats)

        return fitted

    def _search(self, problem: Problem, names: Sequence[str]) -> NestedSearch:
        coarse, seen = coarser(problem), problem.observations
        plane_seen = seen is not None and seen.plane
        weighed = self.sides == "weighed" and not plane_seen and has_depth(problem.finger)
        plane, thick = partial(FemBody, degree=self.degree), partial(ThickBody, degree=self.degree)
        accuracy = ROUGHLY if coarse else COST_CHANGE
        rough = Identifier(self, coarse or problem, plane, names, cost_change=accuracy, weighed=weighed)

        def other(there: Problem, body: Callable[[Unknowns], Body]) -> Identifier:
            return Identifier(self, there, body, names, flexibility=rough.flexibility, weighed=weighed)

        return NestedSearch(
            rough,
            _interpolated,
            fine=other(problem, plane) if coarse else None,
            thick=other(coarse or problem, thick) if weighed else None,
        )


def has_depth(finger: Finger | None) -> bool:
    """Whether a finger has a depth of its own."""
    proposed = isinstance(finger, DrawnFinger) and finger.sources.get("depth") == "proposed"
    return finger is not None and not proposed


def _interpolated(fit: Fit, model: ResponseModel) -> Response:
    """The response of a coarse fit at the nodes of a fine model."""
    here, there = fit.model.body, model.body
    if not (isinstance(here, FemBody) and isinstance(there, FemBody | ThickBody)):
        raise TypeError("the bodies of fem-id are finite elements")
    weights = here.space.shape_functions(there.space.mesh.locate_on(here.space.mesh, there.space.nodes))

    def finer(states: FloatArray) -> FloatArray:
        found = np.zeros((len(states), *there.shape))
        found[..., :2] = [weights @ state for state in states]
        return found

    if isinstance(model, CylinderModel):
        return model.carried(fit.response, here.front, finer)
    state, *slopes = finer(np.stack([fit.response.state, *fit.response.slopes]))
    return replace(fit.response, state=state, slopes=np.array(slopes))
