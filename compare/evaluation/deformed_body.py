"""Checks every result's deformed body: finite, not turned inside out, and not through itself."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from pinnray.comparison.evaluation.certifier import NOT_FINITE
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh, signed_areas
from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.solvers.solution import Solution, Status

INSIDE_OUT = "TURNED INSIDE OUT"
THROUGH_ITSELF = "THE BODY GOES THROUGH ITSELF"
ADVICE = {
    NOT_FINITE: "it counts as not converged",
    INSIDE_OUT: "no material does that; take a smaller stroke, or look at the markers that were given",
    THROUGH_ITSELF: "self-contact is not modelled, so that a result beyond the stroke at which parts meet "
    "says nothing of a real finger; take a smaller stroke",
}
"""Consequence of a fault, and advice."""


class DeformedBody:
    """A body at rest, and the faults of its deformations."""

    def __init__(self, mesh: TriangleMesh) -> None:
        self._mesh, self._space = mesh, LagrangeSpace(mesh, 2)
        # The middles of its edges cut a quadratic triangle into four.
        quarters = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
        self._quarters = self._space.cell_nodes[:, quarters].reshape(-1, 3)

    def inside_out(self, displacement: FloatArray) -> BoolArray:
        """The triangles that are turned inside out, wholly or in one of their quarters, shape (t,).

        Args:
            displacement: Of the mesh's nodes and the middles of its edges, shape (n + e, 2), mm.
        """
        moved = self._space.nodes + displacement
        return np.asarray((signed_areas(moved, self._quarters) <= 0).reshape(-1, 4).any(axis=1))

    def crossings(self, displacement: FloatArray) -> FloatArray:
        """Places where the deformed boundary crosses or touches itself, shape (k, 2), mm, from base to tip.

        Args:
            displacement: Of the mesh's nodes, shape (n, 2), mm.
        """
        edges, points = self._mesh.boundary_edges, self._mesh.points
        lines = shapely.linestrings((points + displacement)[edges])
        one, other = shapely.STRtree(lines).query(lines, predicate="intersects")
        apart = (edges[one][:, :, None] != edges[other][:, None, :]).all(axis=(1, 2)) & (one < other)
        one, other = one[apart], other[apart]
        if len(one):  # a slit is closed at rest
            rest = shapely.linestrings(points[edges])
            opened = ~shapely.intersects(rest[one], rest[other])
            one, other = one[opened], other[opened]
        places = shapely.get_coordinates(shapely.centroid(shapely.intersection(lines[one], lines[other])))
        return np.asarray(places[places[:, 0].argsort()])

    def faults(self, displacement: FloatArray) -> dict[str, str]:
        """The faults of a displacement, keys of `ADVICE`, each with its place.

        Args:
            displacement: Of the mesh's nodes and the middles of its edges, shape (n + e, 2), mm.
        """
        if not np.isfinite(displacement).all():
            return {NOT_FINITE: ""}
        faults = {}
        turned = self.inside_out(displacement)
        if turned.any():
            x, y = self._mesh.points[self._mesh.triangles[turned]].mean(axis=1)[0]
            faults[INSIDE_OUT] = (
                f" in {turned.sum()} of {len(turned)} triangles, one of them at rest at ({x:.3g}, {y:.3g}) mm"
            )
        crossed = self.crossings(displacement[: len(self._mesh.points)])
        if len(crossed):
            x, y = crossed[0]
            faults[THROUGH_ITSELF] = f" near ({x:.3g}, {y:.3g}) mm"
        return faults

    def status(self, solution: Solution) -> tuple[Status, list[str]]:
        """The status of a solution after the checks of `with_body_checks`, and a remark on each fault."""
        faults = self.faults(solution.displacement(self._space.at_nodes()))
        status, law = solution.status, solution.problem.material.law
        judged = Status(*_judged(bool(status.converged), status.message, law, faults), status.warnings)
        return judged, [f"{solution.solver}: {fault}; {ADVICE[fault]}" for fault in faults]


def with_body_checks(
    evaluations: Sequence[Evaluation], mesh: TriangleMesh, truth: Evaluation | None = None
) -> tuple[list[Evaluation], list[str]]:
    """Add a sentence on each fault of its body to an evaluation; and return remarks on the faults.

    A result that is not finite, or of finite strain and turned inside out, does not count as converged. A
    linear law knows no such fault: its equations are those of the body at rest. No law here knows
    self-contact, so that a body that goes through itself is a warning, whatever the law.

    Args:
        evaluations: Sampled on the mesh.
        mesh: The body at rest.
        truth: The simulated finger, if there is one; its faults are remarks only.
    """
    body, checked = DeformedBody(mesh), []
    having: dict[str, list[str]] = {}

    def note_faults(evaluation: Evaluation, name: str) -> dict[str, str]:
        nodal = np.concatenate([evaluation.node_displacement, evaluation.edge_displacement])
        faults = body.faults(nodal) if evaluation.finite else {NOT_FINITE: ""}
        for fault in faults:
            having.setdefault(fault, []).append(name)
        return faults

    for evaluation in evaluations:
        faults = note_faults(evaluation, evaluation.solver)
        converged, message = _judged(evaluation.converged, evaluation.message, evaluation.law, faults)
        checked.append(replace(evaluation, converged=converged, message=message) if faults else evaluation)
    if truth is not None:
        note_faults(truth, "the simulated finger")
    return checked, [f"{', '.join(names)}: {fault}; {ADVICE[fault]}" for fault, names in having.items()]


def _judged(converged: bool, message: str, law: str, faults: dict[str, str]) -> tuple[bool, str]:
    """Whether a result counts as converged, and its message with the faults that it lacks yet."""
    fatal = NOT_FINITE in faults or (INSIDE_OUT in faults and law != "linear")
    said = [f"{fault}{place}" for fault, place in faults.items() if fault not in message]
    return converged and not fatal, "; ".join([message.rstrip(". "), *said]) if said else message
