"""A predicted field: displacement, stress, force and contact of one finger at one stroke, with intervals."""

from collections.abc import Mapping
from dataclasses import dataclass

from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.lagrange import LagrangeField, LagrangeSpace
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution, Status


@dataclass(frozen=True, eq=False)
class PredictedField:
    """A finger under its load as an emulator predicts it.

    Attributes:
        problem: Finger, its mesh, material and load.
        nodal: Displacement of the nodes of quadratic elements, the mesh's nodes first, shape (N, 2), mm.
        von_mises: Stress at the mesh's nodes, shape (n,), MPa; without meaning near re-entrant corners.
        reaction: Force of the indenter on the finger, shape (2,), N/mm.
        energy: Elastic energy per depth, N mm/mm.
        contact: Abscissa of the force and width of the contact, mm.
        figures: By the names of `FIGURES`.
        intervals: Ends of their 95 % intervals.
        error: Root mean square of the displacement's error over that of the displacement, which 19 of 20
            fields stay below.
    """

    problem: Problem
    nodal: FloatArray
    von_mises: FloatArray
    reaction: FloatArray
    energy: float
    contact: tuple[float, float]
    figures: Mapping[str, float]
    intervals: Mapping[str, tuple[float, float]]
    error: float

    @property
    def mesh(self) -> TriangleMesh:
        """The mesh at rest."""
        return self.problem.mesh

    @property
    def displacement(self) -> FloatArray:
        """Displacement of the mesh's nodes, shape (n, 2), mm."""
        return self.nodal[: len(self.mesh.points)]

    def solution(self) -> Solution:
        """The field as a solution, for pictures and comparisons."""
        return Solution(
            solver="emulator",
            problem=self.problem,
            field=LagrangeField(LagrangeSpace(self.mesh, 2), self.nodal),
            energy=self.energy,
            reaction=self.reaction,
            status=Status(
                True, f"predicted; the displacement is off by at most {self.error:.2%} in 19 of 20"
            ),
            stats={},
        )
