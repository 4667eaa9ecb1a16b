"""The two ends of the finger: the traction of a contact on the front face, the clamp and feet at the base.

At the abscissa x the traction's density is the raised cosine 1 + cos(2 π (x - position) / width) within half
a width, scaled to the integral one: smooth in both parameters, zero at both ends.

The clamp is an elastic layer of compliance ℓ (mm), which answers a displacement u of the base by the
traction E u / ℓ. With the base's length b, its middle x_b and the integral I of the squared distance from
it, a base that stays straight under the force f at the point x shifts by ℓ f / (E b) and turns by
ℓ (x - x_b) × f / (E I). The finger moves with it as a rigid body.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from pinnray.geometry.mesh.quadrature import edge_quadrature
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray

LOOSE = 0.1
"""Standard deviation of how far a foot gives, and of how far its ends move when it turns, mm: about as far as
a print is off."""

Sloped = tuple[FloatArray, FloatArray]
"""A quantity with its derivatives."""
QUARTER = np.array([[0.0, -1.0], [1.0, 0.0]])
"""Rotation by 90 degrees."""


class FrontTraction:
    """Quadrature points (q, 2), mm, of a mesh's front face, where a contact may be, and their weights, mm."""

    def __init__(self, mesh: TriangleMesh) -> None:
        self.points, self.lengths = edge_quadrature(mesh, "front", 12)  # an edge may hold the whole contact
        edges = mesh.points[mesh.boundary("front")]
        self.extent = float(np.ptp(edges[..., 0]))
        self.longest = float(np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1).max())
        self.ends = float(self.points[:, 0].min()), float(self.points[:, 0].max())

    def weights(self, position: float, width: float) -> FloatArray:
        """Weights (5, q) of the traction w, 1/mm, and of its derivatives by position x and width b.

        The rows are w, which sums to one, dw/dx, dw/db, d²w/dx² and d²w/dx db.
        """
        offset = self.points[:, 0] - position
        wave, stretch = 2 * np.pi / width, offset / width
        cosine, sine = np.cos(wave * offset), np.sin(wave * offset)
        rows = np.stack(
            [
                1 + cosine,
                wave * sine,
                wave * sine * stretch,
                -(wave**2) * cosine,
                -(wave**2) * cosine * stretch - wave * sine / width,
            ]
        )
        rows = np.where(np.abs(offset) < 0.5 * width, rows, 0.0) * self.lengths
        total, by_x, by_b, by_xx, by_xb = rows.sum(axis=1)
        w = rows[0] / total
        w_x, w_b = (rows[1] - by_x * w) / total, (rows[2] - by_b * w) / total
        w_xx = (rows[3] - by_xx * w - 2 * by_x * w_x) / total
        w_xb = (rows[4] - by_xb * w - by_x * w_b - by_b * w_x) / total
        return np.stack([w, w_x, w_b, w_xx, w_xb])

    def tangent(self, position: float) -> FloatArray:
        """Unit vector along the front toward greater x at an abscissa, shape (2,), from 4 % of its extent."""
        x, y = self.points[self.points[:, 0].argsort()].T
        reach = 0.02 * self.extent
        low, high = (np.interp(position + side * reach, x, y) for side in (-1, 1))
        along = np.array([2 * reach, high - low])
        return np.asarray(along / np.linalg.norm(along))


@dataclass(frozen=True, eq=False)
class RigidMotion:
    """A rotation about a point, then a shift, with their derivatives by p unknowns."""

    centre: FloatArray  # Shape (2,), mm
    shift: FloatArray  # Shape (2,), mm
    turn: float  # Angle, rad
    shift_slopes: FloatArray  # Shape (p, 2)
    turn_slopes: FloatArray  # Shape (p,)

    @property
    def rotation(self) -> FloatArray:
        """The rotation's matrix, shape (2, 2)."""
        return np.asarray(np.cos(self.turn) * np.eye(2) + np.sin(self.turn) * QUARTER)

    def moved(self, places: FloatArray) -> FloatArray:
        """New places of points, both of shape (n, 2), mm."""
        return np.asarray(self.centre + self.shift + (places - self.centre) @ self.rotation.T)

    def slopes(self, places: FloatArray, place_slopes: FloatArray) -> FloatArray:
        """Derivatives (p, n, 2) of the new places of points (n, 2), mm, whose own are given."""
        turned = (places - self.centre) @ (QUARTER @ self.rotation).T
        by_turn = self.turn_slopes[:, None, None] * turned
        return np.asarray(place_slopes @ self.rotation.T + self.shift_slopes[:, None] + by_turn)

    def extrapolated(self, step: FloatArray) -> "RigidMotion":
        """The motion after a step of the unknowns, shape (p,), to first order."""
        turn = self.turn + float(step @ self.turn_slopes)
        return replace(self, shift=self.shift + step @ self.shift_slopes, turn=turn)


class Clamp:
    """The base of a mesh, in one piece or several, on its elastic layer."""

    def __init__(self, mesh: TriangleMesh) -> None:
        points, lengths = edge_quadrature(mesh, "base")
        self.length = float(lengths.sum())
        self.centre = lengths @ points / lengths.sum()
        self.inertia = float(lengths @ ((points - self.centre) ** 2).sum(axis=1))

    def motion(self, softness: tuple[float, FloatArray], force: Sloped, place: Sloped) -> RigidMotion:
        """The finger's motion for ℓ / E, mm/MPa, f, (2,), N/mm, and x, (2,), mm.

        Each argument comes with its derivatives by p unknowns, shapes (p,), (p, 2) and (p, 2).
        """
        (soft, soft_slopes), (f, f_slopes), (x, x_slopes) = softness, force, place
        lever = x - self.centre
        moment, moment_slopes = _cross(lever, f), _cross(x_slopes, f) + _cross(lever, f_slopes)
        shift, turn = soft * f / self.length, float(soft * moment / self.inertia)
        shift_slopes = (np.outer(soft_slopes, f) + soft * f_slopes) / self.length
        turn_slopes = np.asarray((soft_slopes * moment + soft * moment_slopes) / self.inertia)
        return RigidMotion(self.centre, shift, turn, shift_slopes, turn_slopes)


class Feet:
    """The pieces of a base that has several, such as two walls that are held without one between them.

    Each foot stays straight, and may give along its normal, into the finger, and turn about its middle. The
    first one is nearest to the front face. A base in one piece has none: it moves with the clamp.

    Args:
        mesh: Of the finger.
        held: Whether no foot may move: there are none then.

    Attributes:
        names: Of the f motions: `foot_1_give`, mm, `foot_1_turn`, rad, `foot_2_give`, ...
        tolerances: Standard deviations of the motions, shape (f,), as `LOOSE` has them.
    """

    def __init__(self, mesh: TriangleMesh, *, held: bool = False) -> None:
        edges = mesh.boundary("base")
        nodes, local = np.unique(edges, return_inverse=True)
        local = local.reshape(-1, 2)
        graph = coo_matrix((np.ones(len(local)), (local[:, 0], local[:, 1])), shape=(len(nodes), len(nodes)))
        count, label = connected_components(graph, directed=False)
        self._tree, self._label = cKDTree(mesh.points[nodes]), label
        front, inside = mesh.points[mesh.boundary("front")].mean(axis=(0, 1)), mesh.points.mean(axis=0)
        self._feet: list[tuple[int, FloatArray, FloatArray, float]] = []
        for foot in range(count if count > 1 and not held else 0):
            ends = mesh.points[edges[label[local[:, 0]] == foot]]
            lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
            middle = lengths @ ends.mean(axis=1) / lengths.sum()
            spread = ends.reshape(-1, 2) - middle
            into = np.linalg.svd(spread)[2][-1]
            into = into * np.sign((inside - middle) @ into)
            self._feet.append((foot, middle, into, float(lengths.sum())))
        self._feet.sort(key=lambda each: float(np.linalg.norm(each[1] - front)))
        numbers = range(1, len(self._feet) + 1)
        self.names = tuple(f"foot_{number}_{way}" for number in numbers for way in ("give", "turn"))
        self.tolerances = np.array([each for *_, b in self._feet for each in (LOOSE, LOOSE / (0.5 * b))])

    def motions(self, points: FloatArray) -> FloatArray:
        """Displacements (f, n, 2) of points (n, 2) of the base, mm, by a unit of each motion."""
        foot_of = self._label[self._tree.query(points)[1]]
        found = np.zeros((len(self.names), len(points), 2))
        for number, (foot, middle, into, _) in enumerate(self._feet):
            own = foot_of == foot
            found[2 * number, own] = into
            found[2 * number + 1, own] = (points[own] - middle) @ QUARTER.T
        return found


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
