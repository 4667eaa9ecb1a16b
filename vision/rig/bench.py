"""A finger on the bench: fiducials, clamp and indenter around it, markers on it, as a scene."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray
from pinnray.vision.rig.shapes import Paint, Scene, Shape, blot, circle, closed, rectangle
from pinnray.vision.tracking.workspace import Workspace

PAINTS: dict[str, Paint] = {
    "dark": (0.07, 0.065, 0.06),
    "red": (0.10, 0.12, 0.62),
    "green": (0.16, 0.48, 0.12),
    "blue": (0.60, 0.25, 0.08),
}
"""Paints of the markers."""

BENCH: Paint = (0.60, 0.62, 0.61)
FINGER: Paint = (0.80, 0.86, 0.88)
CLAMP: Paint = (0.40, 0.37, 0.35)
INDENTER: Paint = (0.20, 0.42, 0.72)

CLAMP_SIZE = (7.0, 3.0)
"""Extent of the clamp behind the base, and beyond its ends, mm."""
BLADE = ((0.0, 0.0), (0.033, 0.1), (0.033, 0.67))
"""Corners of the right half of the indenter, from the end of the contact, over the finger's height."""
OVERLAP = 0.3
"""Overlap of the indenter with the finger, which hides it, so that no gap is visible, mm."""


@dataclass(frozen=True, eq=False)
class Bench:
    """The finger, its fiducials, clamp and indenter; nodal displacements deform the finger.

    Attributes:
        mesh: Of the finger, whose nodes are moved.
        finger: The finger.
        workspace: Around it.
        paint: Of the markers, one of `PAINTS`.
        irregular: Root mean square deviation of the markers' outlines from circles, over their radius.
    """

    mesh: TriangleMesh
    finger: Finger
    workspace: Workspace
    paint: str = "dark"
    irregular: float = 0.0

    def markers(self, displacement: FloatArray) -> FloatArray:
        """Centres of the markers, shape (m, 3), mm, for nodal displacements, shape (n, 2), mm."""
        points = self.mesh.markers + displacement[self.mesh.marker_nodes]
        return np.column_stack([points, np.full(len(points), self.workspace.marker_plane)])

    def discs(self, displacement: FloatArray) -> list[Shape]:
        """The markers, deformed with the finger, for nodal displacements, shape (n, 2), mm."""
        where = self._marker_borders
        corners = displacement[self.mesh.triangles[where.cells]]
        moved = where.points + np.einsum("nc,ncx->nx", where.barycentric, corners)
        borders = np.split(moved, len(self.mesh.marker_nodes))
        return [Shape(closed(border), PAINTS[self.paint], self.workspace.marker_plane) for border in borders]

    def scene(self, displacement: FloatArray, occluders: Sequence[Shape] = ()) -> Scene:
        """The scene for nodal displacements, shape (n, 2), mm, with occluders in front."""
        moved = self.mesh.points + displacement
        plane = self.workspace.marker_plane
        fiducials = [circle(point, self.workspace.fiducial_diameter / 2) for point in self.workspace.points]
        return Scene(
            BENCH,
            [
                *(Shape(closed(border), PAINTS["dark"]) for border in fiducials),
                *(Shape(block, CLAMP, plane) for block in self._clamps),
                Shape(self._indenter(moved), INDENTER, plane),
                Shape(moved[self.mesh.boundary_edges], FINGER, plane),
                *self.discs(displacement),
                *occluders,
            ],
        )

    def _indenter(self, moved: FloatArray) -> FloatArray:
        """Edges of a blade on the contact, along its normal before loading, shape (n, 2, 2)."""
        edges = self.mesh.boundary("contact")
        frame = _frame(self.mesh.points[edges])
        foot = moved[np.unique(edges)] @ frame.T
        middle, width = foot.mean(axis=0), np.ptp(foot[:, 0])
        blade = np.array(BLADE) * np.ptp(self.finger.section.bounds[:, 0])
        ahead = np.concatenate([[(0.0, -OVERLAP)], blade]) + middle + (width / 2, 0.0)
        behind = 2 * middle[0] - ahead[::-1, 0]
        corners = np.concatenate([ahead, np.column_stack([behind, ahead[::-1, 1]])])
        return closed(corners @ frame)

    @cached_property
    def _clamps(self) -> list[FloatArray]:
        """Edges of a block behind each piece of the base and beyond its ends, each of shape (4, 2, 2)."""
        depth, beyond = CLAMP_SIZE
        blocks = []
        for loop, which in self.finger.section.named("base"):
            points = loop.along(which, np.linspace(0, 1, 65))
            frame = _frame(points[[[0, -1]]])
            (first, inner), (last, outer) = (bound(points @ frame.T, axis=0) for bound in (np.min, np.max))
            block = rectangle((first - beyond, inner), (last + beyond, outer + depth))
            blocks.append(np.asarray(block @ frame))
        return blocks

    @cached_property
    def _marker_borders(self) -> LocatedPoints:
        radius = self.finger.marker_radius
        borders = [
            blot(centre, radius, self.irregular, np.random.default_rng(number))
            for number, centre in enumerate(self.mesh.markers)
        ]
        return self.mesh.locate(np.concatenate(borders))


def _frame(edges: FloatArray) -> FloatArray:
    """Unit vectors against edges (k, 2, 2) with the body on their left, and out of it, shape (2, 2)."""
    along = (edges[:, 0] - edges[:, 1]).sum(axis=0)
    along = along / np.linalg.norm(along)
    return np.stack([along, along[::-1] * (-1, 1)])
