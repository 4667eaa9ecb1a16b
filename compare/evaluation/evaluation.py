"""Samples of a solution on the shared mesh and at the markers, the base of metrics, pictures and reports.

They are kept as an archive of NumPy arrays: a run is resumed, and a result compared again, without a solver.
"""

import json
import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pydantic import TypeAdapter

from pinnray.comparison.evaluation.certificate import Certificate
from pinnray.comparison.evaluation.differences import COMPONENTS, Differences, FieldDifference
from pinnray.geometry.mesh.quadrature import body_quadrature
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.atomic import write_arrays
from pinnray.runtime.content_hash import content_hash, sources_digest
from pinnray.runtime.machine import package_versions
from pinnray.runtime.notebook import brief
from pinnray.solvers.finger_figures import FingerFigures, figures_of
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import IdentifiedForce, SolidField, Solution
from pinnray.solvers.solver import Solver

QUADRATURE_DEGREE = 2
ADAPTERS: dict[str, TypeAdapter[Any]] = {
    "identified": TypeAdapter(IdentifiedForce | None),
    "figures": TypeAdapter(FingerFigures | None),
    "uncertainty": TypeAdapter(Differences | None),
}
"""Of attributes that the archive keeps as JSON, to and from its values."""
IN_SAMPLE = "† was given these markers: its errors there are training errors"
"""Meaning of the mark in `Evaluation.label_at_markers`."""


@dataclass(frozen=True, eq=False)
class Evaluation:
    """One solver's result on the shared mesh: t triangles, n nodes, e edges, m markers, q = 3 t points."""

    solver: str  #: Name of the solver.
    law: str  #: Its material law: "linear" (infinitesimal strain), or one of finite strain (Green-Lagrange).
    converged: bool  #: By the solver's own criterion and, where there is a certificate, its limits.
    message: str  #: The solver's sentence on how it ended, and what the certificate adds.
    energy: float  #: Elastic energy per unit depth, N mm / mm.
    reaction: FloatArray  #: Force of the indenter per unit depth, shape (2,), N/mm.
    stats: Mapping[str, float | int | str]  #: Facts on the solver's run: `seconds`, `unknowns`, ...
    history: Mapping[str, FloatArray]  #: Columns of the training or load-stepping record, all of one length.
    marker_displacement: FloatArray  #: Shape (m, 2), mm.
    node_displacement: FloatArray  #: Shape (n, 2), mm.
    edge_displacement: FloatArray  #: At the middles of the mesh's edges, shape (e, 2), mm.
    weights: FloatArray  #: Quadrature weights, shape (q,), mm^2.
    displacement: FloatArray  #: At the quadrature points, shape (q, 2), mm.
    strain: FloatArray  #: At the quadrature points, shape (q, 2, 2).
    stress: FloatArray  #: Cauchy, at the quadrature points, shape (q, 2, 2), MPa.
    stress_zz: FloatArray  #: Shape (q,), MPa.
    von_mises: FloatArray  #: Shape (q,), MPa.
    energy_density: FloatArray  #: Shape (q,), MPa.
    #: The solver's estimate of its own error: differences of the exact solution from its own.
    uncertainty: Differences | None = None
    marker_uncertainty: FloatArray | None = None  #: That estimate at the markers, absolute, shape (m, 2), mm.
    in_sample: bool = False  #: Whether the solver was given the observations: errors there are of training.
    family: str | None = None  #: Kind of method, from `Traits`.
    twin: str | None = None  #: Name of the finite-element solver that fits the markers in the same way.
    #: Displacement of each marker as the solver predicts it without that marker, shape (m, 2), mm.
    left_out: FloatArray | None = None
    #: Standard deviation of the displacement at the nodes, shape (n, 2), mm, if the solver estimates it.
    node_deviation: FloatArray | None = None
    #: Standard deviation of the von Mises stress at the triangles' centroids, shape (t,), MPa, likewise.
    von_mises_deviation: FloatArray | None = None
    #: What the measurement's pictures show of the markers' displacement, if the solver found their frames.
    shown: FloatArray | None = None
    identified: IdentifiedForce | None = None  #: The force that was found from the markers.
    figures: FingerFigures | None = None  #: What the finger does, if it has a depth and the field is finite.
    warnings: Sequence[str] = ()  #: What speaks against what the solver was given, a sentence each.
    solid: bool = False  #: Whether the field is a plane of a body in three dimensions.
    #: Displacement of the nodes at every row of the history, shape (k, n, 2), mm, if the load was followed.
    path: FloatArray | None = None
    certificate: Certificate | None = None  #: Judgement by the energy of finite elements; not archived.

    __repr__ = brief

    @classmethod
    def of(cls, solution: Solution, mesh: TriangleMesh, markers: ArrayLike | None = None) -> "Evaluation":
        """Sample a solution on the nodes, edges and quadrature points of `mesh` and at the markers.

        Args:
            solution: What to sample; it may have been found on another mesh of the same body.
            mesh: The shared mesh.
            markers: Marker positions, shape (m, 2), mm; those of the mesh if None.
        """
        quadrature = body_quadrature(mesh, QUADRATURE_DEGREE)
        inside, nodes = quadrature.location, LagrangeSpace(mesh, 2).at_nodes()
        if solution.problem.mesh is not mesh:  # a location belongs to its mesh
            inside, nodes = (mesh.locate_on(solution.problem.mesh, place.points) for place in (inside, nodes))
        displacement, state = solution.displacement(inside), solution.state(inside)
        at_nodes = solution.displacement(nodes)
        markers = np.asarray(mesh.markers if markers is None else markers, dtype=np.float64)
        at_markers = solution.displacement_in_space(markers)
        known, other = solution.uncertainty, solution.problem.mesh
        return cls(
            solver=solution.solver,
            law=solution.problem.material.law,
            converged=bool(solution.status.converged),
            message=solution.status.message,
            warnings=list(solution.status.warnings),
            identified=solution.identified,
            energy=float(solution.energy),
            reaction=np.asarray(solution.reaction, dtype=np.float64),
            stats={
                name: value.item() if isinstance(value, np.generic) else value  # Python's own, for JSON
                for name, value in solution.stats.items()
            },
            history={name: np.asarray(column) for name, column in solution.history.items()},
            marker_displacement=at_markers,
            node_displacement=at_nodes[: len(mesh.points)],
            edge_displacement=at_nodes[len(mesh.points) :],
            weights=quadrature.weights,
            displacement=displacement,
            strain=np.ascontiguousarray(state.strain),  # as from the archive, to the last digit of a mean
            stress=state.stress,
            stress_zz=state.stress_zz,
            von_mises=state.von_mises,
            energy_density=state.energy_density,
            in_sample=solution.problem.observations is not None,
            left_out=solution.left_out,
            node_deviation=known.displacement(mesh.locate_on(other, mesh.points)) if known else None,
            von_mises_deviation=known.von_mises(mesh.locate_on(other, mesh.at_centroids().points))
            if known and known.von_mises
            else None,
            shown=solution.shown(markers, at_markers) if solution.pictures else None,
            solid=isinstance(solution.field, SolidField),
            path=np.stack([state.displacement(nodes)[: len(mesh.points)] for state in solution.states])
            if solution.states
            else None,
        )

    @property
    def label(self) -> str:
        """The solver's name, marked where the solver did not converge."""
        return self.solver if self.converged else f"{self.solver} (not converged)"

    @property
    def label_at_markers(self) -> str:
        """The label for errors at the markers, marked if the solver was given those markers."""
        return f"{self.label}{' †' * self.in_sample}"

    @property
    def shown_displacement(self) -> FloatArray:
        """Displacement of the markers, mm, as in the measurement's pictures: shape (m, 2)."""
        return self.marker_displacement if self.shown is None else self.shown

    @property
    def finite(self) -> bool:
        """True if displacement and stress are finite everywhere."""
        fields = (
            *(self.node_displacement, self.edge_displacement, self.displacement, self.marker_displacement),
            *(self.stress, self.von_mises, self.strain),
        )
        return all(np.isfinite(values).all() for values in fields)

    def differences_from(self, reference: "Evaluation") -> Differences:
        """Differences from another evaluation on the same mesh."""

        def differ(name: str, index: tuple[int, ...] = ()) -> FieldDifference:
            values, other = (getattr(each, name)[:, *index] for each in (self, reference))
            return FieldDifference.of(values, other, reference.weights)

        markers = np.abs(self.marker_displacement - reference.marker_displacement).sum(axis=1)
        energy, own = self.energy, reference.energy
        displacement, von_mises = differ("displacement"), differ("von_mises")
        return Differences(
            rel_l2_displacement=displacement.rel_l2,
            rel_l2_von_mises=von_mises.rel_l2,
            mae_markers=float(markers.mean()),
            rel_energy=(energy - own) / own if own else math.nan,
            displacement=displacement,
            von_mises=von_mises,
            stress={name: differ("stress", index) for name, index in COMPONENTS.items()},
            strain={name: differ("strain", index) for name, index in COMPONENTS.items()},
        )

    def per_triangle(self, values: FloatArray) -> FloatArray:
        """Area-weighted mean over each triangle: values at the quadrature points (q, ...) to (t, ...)."""
        weights = self.weights.reshape(-1, 3)
        grouped = values.reshape(-1, 3, *values.shape[1:])
        return np.asarray(np.einsum("tq,tq...->t...", weights / weights.sum(axis=1, keepdims=True), grouped))

    def save(self, path: Path, key: str) -> None:
        """Write the evaluation atomically, with a key by which `load` tells whose result it is."""
        header: dict[str, Any] = {"key": key}
        arrays: dict[str, FloatArray] = {}
        for entry in fields(self):
            value = getattr(self, entry.name)
            if isinstance(value, np.ndarray):
                arrays[entry.name] = value
            elif entry.name not in ("history", "certificate"):
                header[entry.name] = dict(value) if isinstance(value, Mapping) else value
        header |= {name: adapter.dump_python(header[name]) for name, adapter in ADAPTERS.items()}
        arrays |= {f"history_{name}": column for name, column in self.history.items()}
        write_arrays(path, {"header": np.array(json.dumps(header)), **arrays})

    @classmethod
    def load(cls, path: Path, key: str) -> "Evaluation | None":
        """Read an evaluation, or None if there is none under that path and key; warns of a damaged file."""
        if not path.exists():
            return None
        try:
            with np.load(path) as archive:
                header = json.loads(str(archive["header"]))
                if header.pop("key") != key:
                    return None
                arrays = {name: archive[name] for name in archive.files if name != "header"}
            prefix = "history_"
            columns = [name for name in arrays if name.startswith(prefix)]
            header["history"] = {name.removeprefix(prefix): arrays.pop(name) for name in columns}
            header |= {name: adapter.validate_python(header[name]) for name, adapter in ADAPTERS.items()}
            return cls(**header, **arrays)
        except Exception as error:  # a damaged file can make the reader raise anything
            warnings.warn(
                f"{path} is damaged ({type(error).__name__}) and is made again", RuntimeWarning, stacklevel=2
            )
            return None


def solution_key(solver: Solver, problem: Problem, *more: object) -> str:
    """Hash of all that a solution depends on: solver, problem, versions, sources, and more."""
    code = sources_digest(__name__, type(solver).__module__)
    made_by = [solver.name, type(solver).__qualname__, solver.settings(), package_versions(), code]
    return content_hash([*made_by, problem.digest, *more])


def evaluated(solution: Solution, mesh: TriangleMesh, markers: ArrayLike | None = None) -> Evaluation:
    """Evaluate a solution, with its figures, and its uncertainty if its solver estimates its error.

    The uncertainty is the difference of the estimate's improved field from the solution. Under prescribed
    displacements, the energy of the error is the error of the energy.
    """
    own, error = Evaluation.of(solution, mesh, markers), solution.error
    if solution.problem.finger is not None and own.finite:
        own = replace(own, figures=figures_of(solution))
    if error is None:
        return own
    energy = solution.energy * (1 - error.energy_norm**2)
    better = Evaluation.of(replace(solution, field=error.field, energy=energy, states=()), mesh, markers)
    at_markers = np.abs(better.marker_displacement - own.marker_displacement)
    return replace(own, uncertainty=better.differences_from(own), marker_uncertainty=at_markers)
