"""A rigid cylinder pressed on the front face without friction: gaps, forces and their tangent.

The gap is collocated at the nodes of the boundary `front`, which are the points of Simpson's rule on the
edges of quadratic elements. With g the gap of a node, positive outside the cylinder, and λ its multiplier,
the nodal force is q = max(0, λ - k g): the augmented Lagrangian of J. C. Simo, T. A. Laursen, Computers &
Structures 42 (1992) 97-116, without friction. In three dimensions the axis is along z, and k of a node is in
proportion to its level's share of the depth.
"""

from dataclasses import dataclass

import numpy as np

from geometry.arrays import FloatArray, IntArray
from solvers.extrusion import NodalSpace
from solvers.problem import Problem, contact_ends, front_points
from solvers.solution import Contact

CONTACT_AT_END = (
    "the contact reaches an end of the front face, beyond which none is looked for; "
    "press nearer to its middle or take a smaller stroke or radius"
)


@dataclass(frozen=True, eq=False)
class ContactState:
    """A stage of the load; only the front's nodal displacements are read."""

    fraction: float  # Fraction of the load
    nodal: FloatArray  # Displacements, shape (N, d), mm
    # Multipliers λ: in equilibrium the forces on the nodes of the front, shape (l m,), N/mm
    contact: FloatArray


@dataclass(frozen=True, eq=False)
class CylinderContact:
    """The cylinder and the m nodes of the front, by x, at each of l levels; l = 1 in the plane."""

    nodes: IntArray  # Numbers of the nodes, level by level, shape (l m,)
    positions: FloatArray  # Positions in the plane before the load, shape (m, 2), mm
    centre: FloatArray  # Centre of the cylinder before the load, where it touches the front, shape (2,), mm
    travel: FloatArray  # Displacement of the cylinder under the full load, shape (2,), mm
    radius: float  # mm
    stiffness: float  # k of a node, N/mm per mm, times its level's share
    edges: IntArray  # Rows of `positions` along every edge, shape (e, degree + 1)
    shares: FloatArray  # Weights of the levels in a mean over the depth, shape (l,)

    @classmethod
    def of(cls, problem: Problem, space: NodalSpace) -> "CylinderContact":
        """The contact of a problem whose load is a `cylinder`."""
        load, edges = problem.load, problem.mesh.boundary("front")
        section = space.section
        nodes = section.boundary_nodes("front")
        nodes = nodes[np.argsort(section.nodes[nodes, 0])]
        columns = [edges[:, :1], edges[:, 1:]]
        if space.degree == 2:
            columns.insert(1, section.edge_nodes(edges)[:, None])
        starts = len(section.nodes) * np.arange(len(space.shares))
        order = np.argsort(nodes)
        return cls(
            nodes=(starts[:, None] + nodes).ravel(),
            positions=section.nodes[nodes],
            centre=_touching_centre(problem),
            travel=load.values,
            radius=float(load.radius or 0),
            # More would need fewer updates of the multipliers but more Newton iterations.
            stiffness=10.0 * problem.material.young,
            edges=order[np.searchsorted(nodes[order], np.concatenate(columns, axis=1))],
            shares=space.shares,
        )

    @property
    def longest_step(self) -> float:
        """The fraction of the load in which the cylinder moves by half its radius."""
        return float(0.5 * self.radius / np.linalg.norm(self.travel))

    def gaps(self, state: ContactState) -> tuple[FloatArray, FloatArray]:
        """Distances g from the cylinder, shape (l m,), mm, and its outer normals n there, shape (l m, 2)."""
        away = self._moved(state.nodal) - self.centre - state.fraction * self.travel
        distance = np.linalg.norm(away, axis=1)
        return distance - self.radius, away / distance[:, None]

    def forces(self, state: ContactState) -> FloatArray:
        """Forces q along the outer normals, shape (l m,), N/mm, never tension; λ is `state.contact`."""
        return np.maximum(0.0, state.contact - self._stiffness * self.gaps(state)[0])

    def gradient(self, state: ContactState) -> FloatArray:
        """Residual force - q n, the derivative of Σ (q^2 - λ^2) / 2 k, in the plane, shape (l m, 2), N/mm."""
        return -self.forces(state)[:, None] * self.gaps(state)[1]

    def tangent(self, state: ContactState) -> FloatArray:
        """Derivative of the gradient, blocks k n n^T - q (I - n n^T) / (g + radius), (l m, 2, 2)."""
        (gap, normal), force = self.gaps(state), self.forces(state)
        across = np.einsum("mi,mj->mij", normal, normal)
        turning = (force / (gap + self.radius))[:, None, None] * (np.eye(2) - across)
        stiffness = (force > 0) * self._stiffness
        return np.asarray(stiffness[:, None, None] * across - turning)

    @property
    def _stiffness(self) -> FloatArray:
        return np.repeat(self.stiffness * self.shares, len(self.positions))

    def _moved(self, nodal: FloatArray) -> FloatArray:
        """Positions of the deformed nodes in the plane, shape (l m, 2), mm."""
        return np.tile(self.positions, (len(self.shares), 1)) + nodal[self.nodes, :2]

    def front(self, nodal: FloatArray) -> FloatArray:
        """The deformed front, meant over the depth, shape (m, 2), mm."""
        return np.tensordot(self.shares, self._moved(nodal).reshape(len(self.shares), -1, 2), axes=1)

    def lengths(self, nodal: FloatArray) -> FloatArray:
        """Weights of the m places in an integral along the deformed front, shape (m,), mm."""
        moved = self.front(nodal)[self.edges]
        lengths = np.linalg.norm(np.diff(moved, axis=1), axis=2).sum(axis=1)
        shares = {2: (1 / 2, 1 / 2), 3: (1 / 6, 4 / 6, 1 / 6)}[self.edges.shape[1]]
        weights = np.outer(lengths, shares)
        return np.bincount(self.edges.ravel(), weights.ravel(), len(self.positions)).astype(np.float64)


def _touching_centre(problem: Problem) -> FloatArray:
    """Centre of the cylinder, shape (2,), mm: as low above the contact's middle as the front lets it."""
    radius, middle = float(problem.load.radius or 0), float(np.mean(contact_ends(problem)))
    front = problem.mesh.points[np.unique(problem.mesh.boundary("front"))]
    under = np.concatenate([front_points(problem.mesh, np.array([middle])), front])
    under = under[np.abs(under[:, 0] - middle) < radius]
    heights = under[:, 1] + np.sqrt(radius**2 - (under[:, 0] - middle) ** 2)
    return np.array([middle, heights.max()])


@dataclass(frozen=True)
class ContactRegion:
    """The contact region and its pressure."""

    start: float  # Abscissa of the end nearer to the base before the load, mm
    end: float  # Abscissa of the other end, mm
    parts: int  # Number of separate intervals between them
    width: float  # Deformed length of front face in contact, mm
    spacing: float  # Deformed length between neighbouring nodes there, mm: the resolution of the width
    pressure: float  # Largest Cauchy pressure, MPa
    penetration: float  # Largest depth of a node within the cylinder, mm
    force: tuple[float, float]  # Integral of the pressure, N/mm: sum of q n
    at_end: bool  # Whether the region reaches an end of the front face

    def stats(self) -> dict[str, float | int]:
        """Columns of a solution's `stats`."""
        return {
            "contact_start_mm": self.start,
            "contact_end_mm": self.end,
            "contact_parts": self.parts,
            "contact_width_mm": self.width,
            "contact_spacing_mm": self.spacing,
            "contact_pressure_MPa": self.pressure,
            "penetration_mm": self.penetration,
        }

    @classmethod
    def of(cls, contact: CylinderContact, state: ContactState) -> "ContactRegion | None":
        """The region in equilibrium; None where the cylinder does not touch the finger.

        Its ends lie half way between a point that touches and the next one that does not. In three
        dimensions a point touches if it does so anywhere along z, and the pressure is a mean over the depth.
        """
        gap, normal = contact.gaps(state)
        nodal, force = state.nodal, state.contact.reshape(len(contact.shares), -1).sum(axis=0)
        touching = np.flatnonzero(force > 0)
        if not len(touching):
            return None
        first, last = int(touching[0]), int(touching[-1])
        x = contact.positions[:, 0]
        between = np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1]), x[-1:]])
        moved = contact.front(nodal)
        halves = 0.5 * np.linalg.norm(np.diff(moved, axis=0), axis=1)
        shares = np.append(halves, 0.0) + np.insert(halves, 0, 0.0)
        return cls(
            start=float(between[first]),
            end=float(between[last + 1]),
            parts=int(np.count_nonzero(np.diff(touching) > 1)) + 1,
            width=float(shares[touching].sum()),
            spacing=float(shares[touching].max()),
            pressure=float((force / contact.lengths(nodal)).max()),
            penetration=float(max(0.0, -gap.min())),
            force=(float(state.contact @ normal[:, 0]), float(state.contact @ normal[:, 1])),
            at_end=first == 0 or last == len(x) - 1,
        )


def contact_of(problem: Problem, position: float | None, region: ContactRegion | None) -> Contact | None:
    """The contact of a solution by the abscissa of its force, mm; None without force or contact region."""
    if position is None or (problem.load.kind == "cylinder" and region is None):
        return None
    start, end = contact_ends(problem) if region is None else (region.start, region.end)
    return Contact(position, start, end)
