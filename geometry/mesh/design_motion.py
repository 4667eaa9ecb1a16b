"""The motion of a mesh as the parameters of its finger change: no element is made or lost.

A node on the boundary stays at the same fraction of the same piece of the section. Between the
boundaries it moves as an elastic body.
"""

from dataclasses import replace

import numpy as np

from pinnray.geometry.finger.finger import Finger, outline_with_contact
from pinnray.geometry.mesh.extension import elastic
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.section.loop import Loop
from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.runtime.errors import UserError

ON_CURVE = 1e-6
"""Largest distance of a boundary's node from the section, mm."""

STEPS = 4
"""In which the boundary moves; in one step, triangles at joints turn over."""


class MovingMesh:
    """A mesh that follows its finger; its boundary `contact` stays.

    Args:
        mesh: Of the finger's section.
        finger: Whose parameters will change.

    Raises:
        UserError: If the boundary is not the finger's.
    """

    def __init__(self, mesh: TriangleMesh, finger: Finger) -> None:
        self.mesh, self._finger, self._loops = mesh, finger, _loops(finger)
        self._motion = elastic(mesh)
        self._nodes = np.unique(mesh.boundary_edges)
        points = mesh.points[self._nodes]
        found = zip(*(loop.places(points) for loop in self._loops), strict=True)
        pieces, shares, distances = (np.stack(each) for each in found)
        self._loop = distances.argmin(axis=0)
        nearest = self._loop, np.arange(len(points))
        self._piece, self._share = pieces[nearest], shares[nearest]
        if distances[nearest].max() > ON_CURVE:
            raise UserError(f"the mesh is not of the finger {finger.name!r}: its boundary is elsewhere")

    def of(self, finger: Finger) -> TriangleMesh:
        """The mesh of a finger with other parameters.

        Raises:
            UserError: If the section has other pieces, or a triangle turns over.
        """
        loops = _loops(finger.at_contact(self._finger.contact_abscissa))
        if [loop.names for loop in loops] != [loop.names for loop in self._loops]:
            raise UserError("its section has other pieces than that in the middle of the ranges; narrow them")
        moved = np.zeros((len(self.mesh.points), 2))
        for number, loop in enumerate(loops):
            own = self._loop == number
            places = _at(loop, self._piece[own], self._share[own])
            moved[self._nodes[own]] = places - self.mesh.points[self._nodes[own]]
        mesh = replace(self.mesh, points=self.mesh.points + self._motion.of(moved / STEPS))
        for _ in range(STEPS - 1):
            mesh = replace(mesh, points=mesh.points + elastic(mesh).of(moved / STEPS))
        return replace(mesh, depth=finger.depth)


def _loops(finger: Finger) -> tuple[Loop, ...]:
    return (outline_with_contact(finger), *finger.section.cavities)


def _at(loop: Loop, pieces: IntArray, shares: FloatArray) -> FloatArray:
    """Points at fractions (k,) of the lengths of pieces (k,), shape (k, 2), mm."""
    points = np.zeros((len(pieces), 2))
    for which in np.unique(pieces):
        points[pieces == which] = loop.along(int(which), shares[pieces == which])
    return points
