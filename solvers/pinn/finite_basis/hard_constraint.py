"""The clamped base: smooth distances from it, which vanish there and nowhere else, as a hard condition."""

from dataclasses import dataclass

import numpy as np
import torch
from scipy.spatial import cKDTree

from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray

ON_LINE = 1e-9
"""Largest distance of a point on a straight base from its line, in sizes of the body."""
SHALLOW = 0.1
"""Least distance of the body from the line of a straight base, relative to its distance from the base."""
TINY = 1e-13
"""Distance below which a point counts as on the base, mm."""


@dataclass(frozen=True)
class LineDistance:
    """Distance n . x - offset from the line of a straight base, with the body on one side."""

    normal: tuple[float, float]  # n, into the body, of unit length
    offset: float  # Of the line, mm

    def at(self, points: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """The distance of points (n, 2), mm, and its derivatives by x and y, each (n, 1)."""
        along_x, along_y = self.normal
        distance = along_x * points[:, :1] + along_y * points[:, 1:] - self.offset
        one = 0 * distance + 1
        return distance, along_x * one, along_y * one


@dataclass(frozen=True, eq=False)
class CurveDistance:
    """Distance φ from any curve Γ, exact near its inner points and smooth everywhere off it.

        φ(x)^-2 = 1/2 ∫_Γ |x - y|^-3 dy

    For an infinite straight line it is the distance. It is a sum over segments, in closed form, and does not
    depend on how a line is cut into them, so that it serves curves in several pieces. A segment from x + a to
    x + b of length L adds L (|a| + |b|) / (|a| |b| (|a| |b| + a . b)) to the integral, as in the law of Biot
    and Savart.

    Source: A. Belyaev, P.-A. Fayolle, A. Pasko, Signed Lp-distance fields, Computer-Aided Design 45 (2013)
    523-528, here with p = 2 and without a sign.
    """

    segments: FloatArray  # Shape (k, 2, 2), mm, with the body on their left

    def at(self, points: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """The distance of points (n, 2), mm, and its derivatives by x and y, each (n, 1).

        On the curve the derivative is that of a point `TINY` off it.
        """
        ends = torch.from_numpy(np.array(self.segments)).to(points)
        a, b = (ends[:, end].T[:, None] - points.T[:, :, None] for end in range(2))  # (2, n, k)
        along = (ends[:, 1] - ends[:, 0]).T[:, None]
        length = along.norm(dim=0)
        across = torch.stack([-along[1], along[0]])  # derivative of a x b
        cross = a[0] * along[1] - a[1] * along[0]
        cross = torch.where(cross.abs() < TINY * length, TINY * length, cross)
        near, far = a.norm(dim=0).clamp_min(TINY), b.norm(dim=0).clamp_min(TINY)
        to_near, to_far = -a / near, -b / far
        dot = (a * b).sum(dim=0)
        both = far * to_near + near * to_far
        # |a| |b| + a . b = (a x b)^2 / (|a| |b| - a . b), without cancellation beside the segment.
        beside = dot < 0
        safe = torch.where(beside, near * far - dot, near * far + dot)
        last = torch.where(beside, cross**2 / safe, safe)
        rate = torch.where(beside, 2 * across / cross - (both + a + b) / safe, (both - a - b) / safe)
        integral = length * (near + far) / (near * far * last)
        rate = (to_near + to_far) / (near + far) - to_near / near - to_far / far - rate
        total = integral.sum(dim=1, keepdim=True)
        distance = (2 / total).sqrt()
        slope = -0.5 * distance * ((integral / total) * rate).sum(dim=2, keepdim=True)
        return distance, slope[0], slope[1]


BaseDistance = LineDistance | CurveDistance
"""A distance that vanishes on the base only."""


def base_distance(mesh: TriangleMesh) -> BaseDistance:
    """The distance for a mesh: from a line where that vanishes on the base only, else from its segments.

    The line serves a base whose pieces all lie on it, with the rest of the body well on one side.
    """
    nodes = np.unique(mesh.boundary("base"))
    base, size = mesh.points[nodes], float(np.ptp(mesh.points, axis=0).max())
    main = base[:, np.ptp(base, axis=0).argmax()]
    low, high = base[[main.argmin(), main.argmax()]]
    along = (high - low) / np.linalg.norm(high - low)
    normal = np.array([along[1], -along[0]])
    offset = float((base @ normal).mean())
    height = mesh.points @ normal - offset
    if height.sum() < 0:
        normal, offset, height = -normal, -offset, -height
    away, _ = cKDTree(base).query(mesh.points)
    straight = np.abs(height[nodes]).max() <= ON_LINE * size
    if straight and (np.delete(height - SHALLOW * away, nodes) > 0).all():
        return LineDistance((float(normal[0]), float(normal[1])), offset)
    every = mesh.boundary_edges  # with the body on their left
    here = np.isin(mesh.edge_numbers(every), mesh.edge_numbers(mesh.boundary("base")))
    return CurveDistance(mesh.points[every[here]])


@dataclass(frozen=True)
class HardConstraint:
    """A hard Dirichlet condition: the factor d / (d + length) of the distance d to the base.

    With it u = 0 holds on the base for all weights, and on the base only.
    """

    distance: BaseDistance  # d, mm
    length: float  # Distance at which the factor is one half, mm

    @classmethod
    def of(cls, mesh: TriangleMesh, length: float) -> "HardConstraint":
        """The factor for a mesh."""
        return cls(base_distance(mesh), length)

    def at(self, points: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """The factor at points (n, 2), mm, and its derivatives by x and y, 1/mm, each (n, 1)."""
        distance, along_x, along_y = self.distance.at(points)
        slope = self.length / (distance + self.length) ** 2
        return distance / (distance + self.length), slope * along_x, slope * along_y
