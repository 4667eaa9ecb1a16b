"""The boundary-value problem: the argument of every solver."""

import reprlib
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.finger.learned import Learned
from pinnray.geometry.mesh.quadrature import segment_quadrature
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.observations import Observations
from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.runtime.content_hash import content_hash
from pinnray.runtime.errors import UserError
from pinnray.runtime.notebook import brief
from pinnray.solvers.load import Load as Load
from pinnray.solvers.load import LoadKind as LoadKind
from pinnray.solvers.load import Physics as Physics
from pinnray.solvers.load import mean_weight
from pinnray.solvers.material import Material as Material
from pinnray.solvers.material import Substance as Substance


@dataclass(frozen=True, eq=False)
class Problem:
    """Find the displacement of the finger: clamped at `base`, moved at `contact`, free of traction elsewhere.

    Raises:
        UserError: If part of the mesh is not connected to the base, if the contact is not on the front face,
            or if the load moves the contact of a finger farther than the finger is large.
    """

    mesh: TriangleMesh  #: Shared by all solvers
    material: Material = Material()
    load: Load = Load()
    observations: Observations | None = None  #: Marker displacements, for the solvers that assimilate them
    #: The meshed finger, for solvers that need more than the mesh, such as the thickness of a wall
    finger: Finger | None = None
    learned: Learned | None = None  #: Of the finger, for solvers that identify it

    __repr__ = brief

    def __post_init__(self) -> None:
        kinds = {"mesh": TriangleMesh, "material": Material, "load": Load, "observations": Observations}
        for name, kind in kinds.items():
            value = getattr(self, name)
            if not isinstance(value, kind) and not (name == "observations" and value is None):
                raise UserError(f"{name} must be a {kind.__name__}, not {reprlib.repr(value)}")
        count = len(self.mesh.points)
        first, second = self.mesh.edges.T
        graph = coo_matrix((np.ones(len(first)), (first, second)), shape=(count, count))
        _, part = connected_components(graph, directed=False)
        free = ~np.isin(part, part[self.mesh.boundary("base").ravel()])
        if free.any():
            x, y = self.mesh.points[free][0]
            raise UserError(
                f"part of the mesh is not connected to the base: {int(free.sum())} nodes, "
                f"one of them at ({x:.6g}, {y:.6g}) mm"
            )
        travel = float(np.linalg.norm(self.load.values))
        size = float(np.linalg.norm(np.ptp(self.mesh.points, axis=0)))
        if self.finger is not None and travel > size:  # A body of a closed form may have any unit.
            raise UserError(
                f"the load moves the contact by {travel:g} mm, farther than the finger is large "
                f"({size:.3g} mm); give mm"
            )
        left, right = contact_ends(self)
        said = f"the contact from x = {left:.6g} to {right:.6g} mm is not"
        front = self.mesh.points[self.mesh.boundary("front").ravel(), 0]
        slack = 1e-9 * (front.max() - front.min())
        if left < front.min() - slack or right > front.max() + slack:
            face = f"which runs from {front.min():.6g} to {front.max():.6g} mm"
            raise UserError(f"{said} on the front face, {face}")
        if (gap := _gap_in_front(self.mesh, left, right)) is not None:
            advice = "move the contact or make it narrower"
            raise UserError(f"{said} all on the front face, which has a gap at x = {gap:.6g} mm; {advice}")

    @property
    def digest(self) -> str:
        """SHA-256 over everything that defines the problem."""
        content: list[object] = [self.mesh.digest, self.material.model_dump(), self.load.model_dump()]
        if (seen := self.observations) is not None:
            content += [seen.points, seen.displacements, seen.standard_deviations, seen.visible]
            content += [seen.weighed, seen.marker_radius]
            content += [*vars(seen.pressed).values(), *vars(seen.drawn).values()]
        if self.finger is not None:
            content.append(self.finger.digest)
        if self.learned is not None:
            content.append(self.learned.model_dump())
        if self.material.substance is not None:  # of which the figures are
            content += self.material.substance
        return content_hash(content)


def contact_ends(problem: Problem) -> tuple[float, float]:
    """Abscissae of the contact's two ends, mm."""
    x = problem.mesh.points[problem.mesh.boundary("contact").ravel(), 0]
    if problem.load.position is None:
        return float(x.min()), float(x.max())
    half = 0.5 * (x.max() - x.min())
    return float(problem.load.position - half), float(problem.load.position + half)


def contact_nodes(problem: Problem) -> IntArray:
    """Nodes of the front face between the contact's ends and, if it has none there, the nearest."""
    left, right = contact_ends(problem)
    nodes = np.unique(problem.mesh.boundary("front"))
    outside = np.abs(problem.mesh.points[nodes, 0] - 0.5 * (left + right)) - 0.5 * (right - left)
    near = outside <= max(float(outside.min()), 1e-9 * (right - left))
    return np.asarray(nodes[near], dtype=np.int64)


def contact_functional(problem: Problem) -> tuple[FloatArray, FloatArray]:
    """The load's linear functional: points (q, 2), mm, and weights (q,), of sum one, of their displacements.

    For `mean` the weights are `mean_weight` along x; on a curved front they weigh true lengths and are scaled
    to the integral one. For `point` it is the middle node, or the point at `position`.
    """
    mesh, load = problem.mesh, problem.load
    if load.kind == "point" and load.position is None:
        return mesh.points[[mesh.contact_node]], np.ones(1)
    left, right = contact_ends(problem)
    middle, width = 0.5 * (left + right), right - left
    if load.kind == "point":
        return front_points(mesh, np.array([middle])), np.ones(1)
    count = 12  # points on an edge, enough if one edge holds the whole contact
    points, lengths = segment_quadrature(*_front_between(mesh, left, right), count)
    weights = lengths * mean_weight(points[:, 0] - middle, width)
    return points, weights / weights.sum()


def front_points(mesh: TriangleMesh, x: FloatArray) -> FloatArray:
    """Points of the front face at abscissae (n,), shape (n, 2), mm; a gap in it is bridged straight."""
    nodes = mesh.points[np.unique(mesh.boundary("front"))]
    nodes = nodes[nodes[:, 0].argsort()]
    return np.column_stack([x, np.interp(x, nodes[:, 0], nodes[:, 1])])


def _front_between(mesh: TriangleMesh, left: float, right: float) -> tuple[FloatArray, FloatArray]:
    """Ends, each (s, 2), mm, along x, of the pieces of the front's edges between two abscissae."""
    ends = mesh.points[mesh.boundary("front")]
    ends = np.take_along_axis(ends, ends[:, :, :1].argsort(axis=1), axis=1)
    ends = ends[ends[:, 0, 0].argsort()]
    start, end = ends[:, 0], ends[:, 1]
    length = end[:, :1] - start[:, :1]
    cuts = [np.clip((x - start[:, :1]) / length, 0, 1) for x in (left, right)]
    inside = (cuts[1] - cuts[0])[:, 0] > 1e-9
    first, last = (start + cut * (end - start) for cut in cuts)
    return first[inside], last[inside]


def _gap_in_front(mesh: TriangleMesh, left: float, right: float) -> float | None:
    """Start of the first gap of the front face between two abscissae, mm; None where it has none."""
    x = np.sort(mesh.points[mesh.boundary("front"), 0], axis=1)
    x = x[x[:, 0].argsort()]
    start, end = np.maximum.accumulate(x[:-1, 1]), x[1:, 0]
    slack = 1e-9 * np.ptp(x)
    gap = (end > start + slack) & (start < right - slack) & (end > left + slack)
    return float(max(start[gap][0], left)) if gap.any() else None
