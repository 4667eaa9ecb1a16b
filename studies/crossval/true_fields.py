"""The true fields of a cross-validation: simulations on finer meshes, sampled over the body."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np

from pinnray.comparison.evaluation.differences import relative_l2
from pinnray.comparison.evaluation.truths import Truth
from pinnray.comparison.evaluation.virtual_experiment import simulate
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.geometry.mesh.quadrature import body_quadrature
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.mesh.wall_motion import WallMotion
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.cache import cache_folder, cached
from pinnray.runtime.content_hash import content_hash, sources_digest
from pinnray.runtime.errors import UserError
from pinnray.runtime.machine import package_versions
from pinnray.solvers.assimilation.misfit import disc_quadrature, radius_within
from pinnray.solvers.problem import Load, Problem
from pinnray.solvers.solution import SolidField, Solution, State, stroke_axes
from pinnray.studies.crossval.folds import LoadCase
from pinnray.studies.crossval.study import SIZES, CrossvalStudy


class SampledField(NamedTuple):
    """A displacement field at m markers and q quadrature points of the body.

    Attributes:
        markers: Means over the markers' discs, shape (m, 2), mm.
        displacement: Shape (q, 2), mm.
        gradient: du_i/dx_j, shape (q, 2, 2); (q, 3, 3) on a face of a body in three dimensions.
    """

    markers: FloatArray
    displacement: FloatArray
    gradient: FloatArray

    def state(self, problem: Problem) -> State:
        """Strain and stress by the law of a problem."""
        return State.from_gradient(self.gradient, problem)

    def distances(
        self, truth: "SampledField", own: Problem, finite: Problem, weights: FloatArray
    ) -> dict[str, float]:
        """Relative L2 distances of displacement, strain and von Mises stress from the truth over the body.

        Args:
            truth: The true displacement.
            own: Problem with the solver's law.
            finite: Problem with the truth's law; it also gives this displacement's `von_mises_true_law`.
            weights: Quadrature weights, shape (q,), mm².
        """
        state, true = self.state(own), truth.state(finite)
        with np.errstate(invalid="ignore"):  # an inverted element has no such stress
            with_true_law = self.state(finite)
        flat = (len(weights), -1)
        pairs = {
            "displacement": (self.displacement, truth.displacement),
            "strain": (state.strain.reshape(flat), true.strain.reshape(flat)),
            "von_mises": (state.von_mises, true.von_mises),
            "von_mises_true_law": (with_true_law.von_mises, true.von_mises),
        }
        return {name: relative_l2(*pair, weights) for name, pair in pairs.items()}


@dataclass(frozen=True, eq=False)
class FieldSampler:
    """The points of the shared mesh at which fields are sampled."""

    inside: LocatedPoints  # quadrature points of the body
    weights: FloatArray  # their weights, shape (q,), mm²
    centres: LocatedPoints  # of the markers
    discs: LocatedPoints  # points of the markers' discs
    means: FloatArray  # weights that average the discs' points to the markers, shape (m, d)

    @classmethod
    def of(cls, mesh: TriangleMesh, markers: FloatArray, radius: float) -> "FieldSampler":
        """On the shared mesh, for markers at (m, 2), mm, of a radius, mm."""
        rule = body_quadrature(mesh)
        points, means = disc_quadrature(markers, radius_within(mesh, markers, radius))
        return cls(rule.location, rule.weights, mesh.locate(markers), mesh.locate(points), means)

    def of_solution(
        self, solution: Solution, mesh: TriangleMesh, changes: Mapping[str, float] | None = None
    ) -> SampledField:
        """Sample a solution, which may have another mesh than the shared one.

        Args:
            solution: On a mesh of the same finger.
            mesh: The shared mesh.
            changes: Wall thicknesses of the solution's finger minus those of the shared mesh, mm, by their
                names in `Design`: the points of the body move with the walls, markers stay in space.
        """
        inside, discs = self.inside_of(solution, mesh, changes), self.discs
        if solution.problem.mesh is not mesh:  # a location belongs to its mesh
            discs = mesh.locate_on(solution.problem.mesh, discs.points)
        field, markers = solution.field, self.means @ solution.displacement_in_space(discs)
        gradient = field.solid_gradient if isinstance(field, SolidField) else field.gradient
        return SampledField(markers, field.displacement(inside), gradient(inside))

    def inside_of(
        self, solution: Solution, mesh: TriangleMesh, changes: Mapping[str, float] | None = None
    ) -> LocatedPoints:
        """The quadrature points on the mesh of a solution; for the arguments see `of_solution`."""
        if solution.problem.mesh is mesh:
            return self.inside
        points = self.inside.points
        if changes:
            motion = WallMotion.of(mesh)
            if missing := [name for name in changes if name not in motion.names]:
                raise UserError(f"the finger has no wall of the {missing[0]} that the truth changes")
            thicker = np.array([changes.get(name, 0.0) for name in motion.names])
            points = points + motion.shifts(self.inside, thicker)
        return mesh.locate_on(solution.problem.mesh, points)


@dataclass(frozen=True, eq=False)
class TrueField:
    """A true field at the points of the shared mesh, moved with the walls, and the force on the finger."""

    sampled: SampledField
    force: float  # along the stroke, N/mm
    tangential: float  # across it, N/mm
    position: float  # abscissa where it acts, before the load, mm


@dataclass(frozen=True)
class TruthTask:
    """A truth and a load case of a study, which a process simulates and samples on the shared mesh."""

    study: CrossvalStudy
    truth: Truth
    case: LoadCase
    mesh: TriangleMesh


def simulate_truth(task: TruthTask, _: object = None) -> dict[str, TrueField]:
    """Simulate the true field, unless the cache has it, and sample it with the markers of every layout.

    Returns:
        The field by layout.

    Raises:
        UserError: If the simulation cannot be run or does not reach the full load.
    """
    study, truth, shared = task.study, task.truth, task.mesh
    drawn = study.design.at_contact(task.case.contact)
    design = truth.finger(drawn)
    stroke = -task.case.share * float(truth.reached(study.load).displacement[1] or 0.0)
    parts = [
        design.digest,
        study.mesh and study.mesh.model_dump(),
        shared.digest,
        truth.material(study.material).model_dump(),
        truth.load(stroke).model_dump(),
        truth.finer,
        package_versions(),
        sources_digest(__name__),
    ]

    @lru_cache(maxsize=1)
    def solution() -> Solution:
        sizes = study.mesh or SIZES
        finer = sizes.model_copy(update={"size": truth.finer * sizes.size})
        mesh = finger_mesh(design, settings=finer)
        return simulate(Problem(mesh, study.material, Load(displacement=(0.0, -stroke))), truth=truth)

    def sampled(points: FloatArray) -> TrueField:
        sampler, found = FieldSampler.of(shared, points, design.marker_radius), solution()
        if found.contact is None:  # the cylinder has slipped off
            raise UserError(f"the virtual experiment: {found.status.message}")
        field = sampler.of_solution(found, shared, truth.changes(drawn))
        force, tangential = (stroke_axes(study.load) @ found.reaction).tolist()
        return TrueField(field, force, tangential, found.contact[0])

    return {
        layout: cached(
            cache_folder() / f"truth-{content_hash([*parts, points.tolist()])}.pickle",
            "the virtual experiment",
            partial(sampled, points),
        )
        for layout, points in study.markers.items()
    }
