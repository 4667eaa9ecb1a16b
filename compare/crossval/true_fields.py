"""The truth that solvers are judged by: the virtual experiment on a mesh of half the size, everywhere."""

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from compare.evaluation.differences import field_difference
from compare.evaluation.virtual_experiment import SOURCES, simulate
from compare.runtime.provenance import package_versions, sources_digest
from geometry.arrays import FloatArray
from geometry.atomic import atomic_path
from geometry.cache import cache_folder, finger_mesh
from geometry.content_hash import content_hash
from geometry.finger.design import Design
from geometry.mesh.point_location import LocatedPoints
from geometry.mesh.quadrature import body_quadrature
from geometry.mesh.settings import MeshSettings
from geometry.mesh.triangle_mesh import TriangleMesh
from solvers.assimilation.misfit import disc_quadrature, radius_within
from solvers.problem import Load, Material, Problem
from solvers.solution import Solution, State
from solvers.solver import Progress, silent

FINER = 0.5
"""Size of the truth's elements over that of the shared mesh."""


@dataclass(frozen=True, eq=False)
class SampledField:
    """A displacement field at m markers and q points of the body; a linear space.

    Attributes:
        markers: Means over the markers' discs, shape (m, 2), mm.
        displacement: Shape (q, 2), mm.
        gradient: du_i/dx_j, shape (q, 2, 2).
    """

    markers: FloatArray
    displacement: FloatArray
    gradient: FloatArray

    def __add__(self, other: "SampledField") -> "SampledField":
        return SampledField(
            self.markers + other.markers,
            self.displacement + other.displacement,
            self.gradient + other.gradient,
        )

    def __mul__(self, factor: float) -> "SampledField":
        return SampledField(factor * self.markers, factor * self.displacement, factor * self.gradient)


@dataclass(frozen=True, eq=False)
class FieldSampler:
    """Where fields are looked at.

    Attributes:
        inside: Quadrature points of the shared mesh.
        weights: Their areas, shape (q,), mm².
        centres: Of the markers.
        discs: Points of the markers' discs.
        means: From values at these points to the markers', shape (m, d).
    """

    inside: LocatedPoints
    weights: FloatArray
    centres: LocatedPoints
    discs: LocatedPoints
    means: FloatArray

    @classmethod
    def of(cls, mesh: TriangleMesh, markers: FloatArray, radius: float) -> "FieldSampler":
        """On the shared mesh, for markers at (m, 2), mm, of a radius, mm."""
        rule = body_quadrature(mesh)
        points, means = disc_quadrature(markers, radius_within(mesh, markers, radius))
        return cls(rule.location, rule.weights, mesh.locate(markers), mesh.locate(points), means)

    def of_solution(self, solution: Solution, mesh: TriangleMesh) -> SampledField:
        """Sample a solution, which may have been found on another mesh than the shared one."""
        inside, discs = self.inside, self.discs
        if solution.problem.mesh is not mesh:  # a location belongs to its mesh
            inside, discs = (solution.problem.mesh.locate(place.points) for place in (inside, discs))
        return SampledField(
            markers=self.means @ solution.field.displacement(discs),
            displacement=solution.field.displacement(inside),
            gradient=solution.field.gradient(inside),
        )


@dataclass(frozen=True, eq=False)
class TrueFields:
    """The true fields at one load.

    Attributes:
        markers: Displacements, means over the discs, shape (m, 2), mm.
        displacement: Shape (q, 2), mm.
        strain: Green-Lagrange, shape (q, 2, 2).
        von_mises: Of the Cauchy stress, shape (q,), MPa.
    """

    markers: FloatArray
    displacement: FloatArray
    strain: FloatArray
    von_mises: FloatArray

    @classmethod
    def load(cls, path: Path) -> "TrueFields":
        """Read what `save` wrote."""
        with np.load(path) as archive:
            return cls(**{entry.name: archive[entry.name] for entry in fields(cls)})

    def save(self, path: Path) -> None:
        """Write atomically."""
        with atomic_path(path) as partial:
            np.savez(partial, **{entry.name: getattr(self, entry.name) for entry in fields(self)})

    def distance(
        self, sampled: SampledField, own: Problem, finite: Problem, weights: FloatArray
    ) -> dict[str, float]:
        """Relative L2 distances of a solver's fields over the body.

        Args:
            sampled: The solver's displacement.
            own: With the solver's law, which makes strain and stress of it.
            finite: With the truth's law, which makes the stress `von_mises_finite` of it.
            weights: Areas of the points, shape (q,), mm².
        """
        state = State.from_gradient(sampled.gradient, own)
        with np.errstate(invalid="ignore"):  # a body that is turned inside out has no such stress
            turned = State.from_gradient(sampled.gradient, finite)
        flat = (len(weights), -1)
        pairs = {
            "displacement": (sampled.displacement, self.displacement),
            "strain": (state.strain.reshape(flat), self.strain.reshape(flat)),
            "von_mises": (state.von_mises, self.von_mises),
            "von_mises_finite": (turned.von_mises, self.von_mises),
        }
        return {name: field_difference(*pair, weights).rel_l2 for name, pair in pairs.items()}


@dataclass(frozen=True)
class TruthTask:
    """All that a process needs to find a truth.

    Attributes:
        design: The finger, with the contact where it is pressed.
        settings: Of the shared mesh.
        shared: File of the shared mesh.
        material: Elastic constants.
        stroke: -v of the indenter, mm.
    """

    design: Design
    settings: MeshSettings
    shared: Path
    material: Material
    stroke: float

    @property
    def entry(self) -> Path:
        """Where it is kept: a file of the cache."""
        parts = [
            self.design.digest,
            self.settings.model_dump(),
            TriangleMesh.load(self.shared).digest,
            self.material.model_dump(),
            self.stroke,
            FINER,
            package_versions(),
            sources_digest(
                [*SOURCES, "compare.crossval.true_fields", "compare.evaluation.virtual_experiment"]
            ),
        ]
        digest = content_hash(parts)
        return cache_folder() / f"truth-{digest}.npz"


def find_truth(task: TruthTask, progress: Progress = silent) -> Path:
    """Simulate, or find in the cache, and give the file.

    Raises:
        UserError: If the simulation cannot be run or does not reach the full load.
    """
    entry = task.entry
    if entry.exists():
        progress(1.0, "from the cache")
        return entry
    shared = TriangleMesh.load(task.shared)
    finer = task.settings.model_copy(update={"size": FINER * task.settings.size})
    mesh = finger_mesh(task.design, settings=finer)
    problem = Problem(mesh, task.material, Load(displacement=(0.0, -task.stroke)))
    solution = simulate(problem, progress)
    sampler = FieldSampler.of(shared, shared.markers, task.design.marker_radius)
    sampled = sampler.of_solution(solution, shared)
    state = State.from_gradient(sampled.gradient, solution.problem)
    TrueFields(sampled.markers, sampled.displacement, state.strain, state.von_mises).save(entry)
    return entry
