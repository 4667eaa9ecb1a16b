"""A solution sampled on the shared mesh and at the markers: all that metrics, pictures and reports look at.

It is an archive of NumPy arrays, so that a run can be resumed, and a result compared again, without any
solver.
"""

import json
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pydantic import TypeAdapter

from compare.evaluation.certificate import Certificate
from compare.evaluation.differences import ReferenceDifferences
from geometry.arrays import FloatArray
from geometry.atomic import write_arrays
from geometry.mesh.quadrature import body_quadrature
from geometry.mesh.triangle_mesh import TriangleMesh
from solvers.lagrange import LagrangeSpace
from solvers.solution import SolidField, Solution

QUADRATURE_DEGREE = 2
HISTORY_PREFIX = "history_"
IN_SAMPLE = "† was given these markers: its errors there are training errors"
"""Meaning of the mark in `Evaluation.label_at_markers`."""
UNCERTAINTY: TypeAdapter[ReferenceDifferences | None] = TypeAdapter(ReferenceDifferences | None)


@dataclass(frozen=True, eq=False)
class Evaluation:
    """One solver's result on the shared mesh: t triangles, n nodes, e edges, m markers, q = 3 t points.

    Attributes:
        solver: Name of the solver.
        law: Material law that it had: "linear" (infinitesimal strain) or of finite strain (Green-Lagrange).
        converged: Whether the solver's own criterion was met and, where there is a certificate, its limit.
        message: The solver's sentence on how it ended, and what the certificate adds.
        energy: Elastic energy per unit depth, N mm / mm.
        reaction: Force of the indenter per unit depth, shape (2,), N/mm.
        stats: What the solver says of its run: `seconds`, `unknowns`, ...
        history: Columns of the training or load-stepping record, all of one length.
        marker_displacement: Shape (m, 2), mm.
        node_displacement: Shape (n, 2), mm.
        edge_displacement: At the middles of the mesh's edges, shape (e, 2), mm.
        weights: Quadrature weights, shape (q,), mm^2.
        displacement: At the quadrature points, shape (q, 2), mm.
        strain: At the quadrature points, shape (q, 2, 2).
        stress: Cauchy, at the quadrature points, shape (q, 2, 2), MPa.
        stress_zz: Shape (q,), MPa.
        von_mises: Shape (q,), MPa.
        energy_density: Shape (q,), MPa.
        uncertainty: The solver's estimate of its own error, as differences of the exact solution from it.
        marker_uncertainty: The same at the markers, absolute, shape (m, 2), mm.
        in_sample: Whether the solver was given the observations: its errors at them are training errors.
        family: Kind of method, of `Traits`.
        twin: Name of the solver by finite elements that fits the markers in the same way, if there is one.
        left_out: Displacement of each marker as the solver predicts it without that marker, shape (m, 2), mm;
            None where it does not tell.
        solid: Whether the field is a plane of a body in three dimensions.
        path: Displacement of the nodes at every row of the history, shape (k, n, 2), mm, from a solver that
            follows the load; None from any other.
        certificate: What the result is worth by the energy of finite elements; not part of the archive.
    """

    solver: str
    law: str
    converged: bool
    message: str
    energy: float
    reaction: FloatArray
    stats: Mapping[str, float | int | str]
    history: Mapping[str, FloatArray]
    marker_displacement: FloatArray
    node_displacement: FloatArray
    edge_displacement: FloatArray
    weights: FloatArray
    displacement: FloatArray
    strain: FloatArray
    stress: FloatArray
    stress_zz: FloatArray
    von_mises: FloatArray
    energy_density: FloatArray
    uncertainty: ReferenceDifferences | None = None
    marker_uncertainty: FloatArray | None = None
    in_sample: bool = False
    family: str | None = None
    twin: str | None = None
    left_out: FloatArray | None = None
    solid: bool = False
    path: FloatArray | None = None
    certificate: Certificate | None = None

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
        state, displacement = solution.state(inside), solution.displacement(nodes)
        return cls(
            solver=solution.solver,
            law=solution.problem.material.law,
            converged=bool(solution.status.converged),
            message=solution.status.message,
            energy=float(solution.energy),
            reaction=np.asarray(solution.reaction, dtype=np.float64),
            stats={
                name: value.item() if isinstance(value, np.generic) else value  # Python's own, for JSON
                for name, value in solution.stats.items()
            },
            history={name: np.asarray(column) for name, column in solution.history.items()},
            marker_displacement=solution.displacement_in_space(mesh.markers if markers is None else markers),
            node_displacement=displacement[: len(mesh.points)],
            edge_displacement=displacement[len(mesh.points) :],
            weights=quadrature.weights,
            displacement=solution.displacement(inside),
            strain=state.strain,
            stress=state.stress,
            stress_zz=state.stress_zz,
            von_mises=state.von_mises,
            energy_density=state.energy_density,
            in_sample=solution.problem.observations is not None,
            left_out=solution.left_out,
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
        """The label for errors at the markers: it has a mark if the solver was given those markers."""
        return f"{self.label}{' †' * self.in_sample}"

    @property
    def finite(self) -> bool:
        """True if displacement and stress are finite everywhere."""
        fields = (
            *(self.node_displacement, self.edge_displacement, self.displacement, self.marker_displacement),
            *(self.stress, self.von_mises, self.strain),
        )
        return all(np.isfinite(values).all() for values in fields)

    def per_triangle(self, values: FloatArray) -> FloatArray:
        """Area-weighted mean over each triangle: values at the quadrature points (q, ...) to (t, ...)."""
        points = 3
        weights = self.weights.reshape(-1, points)
        grouped = values.reshape(-1, points, *values.shape[1:])
        return np.asarray(np.einsum("tq,tq...->t...", weights / weights.sum(axis=1, keepdims=True), grouped))

    def save(self, path: Path, key: str) -> None:
        """Write the evaluation atomically under a key that says what it is the result of."""
        header: dict[str, Any] = {"key": key}
        arrays: dict[str, FloatArray] = {}
        for entry in fields(self):
            value = getattr(self, entry.name)
            if isinstance(value, np.ndarray):
                arrays[entry.name] = value
            elif entry.name not in ("history", "certificate"):
                header[entry.name] = dict(value) if isinstance(value, Mapping) else value
        arrays |= {HISTORY_PREFIX + name: column for name, column in self.history.items()}
        write_arrays(path, {"header": np.array(json.dumps(header)), **arrays})

    @classmethod
    def load(cls, path: Path, key: str) -> "Evaluation | None":
        """Read an evaluation, or None if there is none under that path and key; warns of a damaged file."""
        if not path.exists():
            return None
        try:
            return cls._read(path, key)
        except Exception as error:  # a damaged file can make the reader raise anything
            warnings.warn(
                f"{path} is damaged ({type(error).__name__}) and is made again", RuntimeWarning, stacklevel=2
            )
            return None

    @classmethod
    def _read(cls, path: Path, key: str) -> "Evaluation | None":
        with np.load(path) as archive:
            header = json.loads(str(archive["header"]))
            if header.pop("key") != key:
                return None
            arrays = {name: archive[name] for name in archive.files if name != "header"}
        history = {
            name.removeprefix(HISTORY_PREFIX): arrays.pop(name)
            for name in list(arrays)
            if name.startswith(HISTORY_PREFIX)
        }
        header["uncertainty"] = UNCERTAINTY.validate_python(header["uncertainty"])
        return cls(history=history, **(header | arrays))
