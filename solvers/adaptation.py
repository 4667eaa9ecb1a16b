"""The record of an adaptive refinement, by the estimated error of the markers' displacements."""

from dataclasses import dataclass
from math import inf
from typing import NamedTuple

from geometry.errors import UserError
from geometry.mesh.triangle_mesh import TriangleMesh
from solvers.problem import Load


class RefinementRound(NamedTuple):
    """One mesh of the sequence."""

    triangles: int  # Number of triangles
    nodes: int  # Number of nodes
    at_markers: float  # Largest estimated error of u or v at a marker, mm
    energy_norm: float  # Estimated relative error in the energy norm


@dataclass(frozen=True, eq=False)
class Adaptation:
    """A refined mesh and the rounds that led to it."""

    tolerance: float  # Tolerance of u and v at the markers, mm
    rounds: tuple[RefinementRound, ...]  # From the first mesh to the refined one
    mesh: TriangleMesh  # The refined mesh

    @property
    def reached(self) -> bool:
        """True if the estimate is within the tolerance."""
        return self.rounds[-1].at_markers <= self.tolerance

    @property
    def message(self) -> str:
        """The outcome, in a sentence without its full stop."""
        first, last = self.rounds[0], self.rounds[-1]
        if not self.reached:
            return (
                f"the markers are known to {last.at_markers:.2g} mm, not to the {self.tolerance:g} mm asked "
                f"for: refinement stopped at {last.triangles} triangles; take a larger tolerance"
            )
        return (
            f"the markers are known to {last.at_markers:.2g} mm (asked for: {self.tolerance:g} mm); "
            f"{first.triangles} triangles became {last.triangles}"
        )


def check_adaptable(tolerance: float, load: Load) -> None:
    """Raise a `UserError` if the tolerance is no length, mm, or refinement cannot adapt to the load."""
    if not 0 < tolerance < inf:
        raise UserError(f"a tolerance of {tolerance:g} mm at the markers: give a length above 0 mm")
    if load.kind == "point":
        raise UserError("a point load has no limit under refinement to adapt a mesh to; take mean or patch")
    if load.kind not in ("mean", "patch"):
        raise UserError(
            f"the mesh is adapted by the estimate of fem, which has no load {load.kind}; take mean or patch"
        )
