"""The identified displacement with standard deviations, over the drawn body."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.geometry.mesh.wall_motion import WallMotion
from pinnray.geometry.picture_frame import Pictures
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.elasticity import deformation_jacobian
from pinnray.solvers.identification.body import Body
from pinnray.solvers.identification.boundary import RigidMotion
from pinnray.solvers.identification.model import Response, ResponseModel
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import State

STEP = 1e-3
"""Difference quotient's step in standard errors: the error of first order is a thousandth of a deviation."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """The finger for one set of values of the unknowns, a displacement field.

    Positions are drawn ones: the material drawn at X is at X + W(X) before the load.
    """

    problem: Problem  # With the law and the moduli
    walls: WallMotion  # The motions by the walls' thickness
    changes: FloatArray  # Of the walls' thickness, shape (k,), mm
    clamp: RigidMotion  # Motion of the clamp
    body: Body  # The discretised finger
    state: FloatArray  # Its displacement without the clamp's
    pictures: Pictures  # Frames of the observations' pictures

    def located(self, points: ArrayLike | LocatedPoints) -> LocatedPoints:
        """Points of the problem's mesh in that of the body, which may be a coarser one."""
        drawn, own = self.problem.mesh, self.walls.mesh
        if isinstance(points, LocatedPoints):
            return points if own is drawn else drawn.locate_on(own, points.points)
        return drawn.locate_on(own, points)

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Displacement of the material drawn at points, shape (n, 2), mm."""
        location = self.located(location)
        places = location.points + self.walls.shifts(location, self.changes)
        return self.clamp.moved(places + self.body.field(self.state).displacement(location)) - places

    def displacement_in_space(self, location: LocatedPoints) -> FloatArray:
        """Displacement of the material that is at points before the load, to first order, (n, 2), mm."""
        return displacements_in_space([self], location)[0]

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Gradient of the displacement by the place before the load, shape (n, 2, 2)."""
        return gradients([self], location)[0][:, :2, :2]

    def _gradient(self, drawn: FloatArray, location: LocatedPoints) -> FloatArray:
        """`gradient` from that by the drawn position without the clamp, both of shape (n, d, d)."""
        walls = np.einsum("k,ktij->tij", self.changes, self.walls.gradients)
        cofactors = (1 + np.trace(walls, axis1=1, axis2=2))[:, None, None] * np.eye(2) - walls
        inverse, turned = (np.eye(drawn.shape[-1]) * np.ones((count, 1, 1)) for count in (len(walls), 1))
        inverse[:, :2, :2] = cofactors / deformation_jacobian(walls)[:, None, None]
        turned[:, :2, :2] = self.clamp.rotation
        gradient = drawn @ inverse[location.cells]
        return np.asarray(turned @ (np.eye(len(turned[0])) + gradient) - np.eye(len(turned[0])))


def displacements_in_space(snapshots: Sequence[Snapshot], location: LocatedPoints) -> list[FloatArray]:
    """`Snapshot.displacement_in_space` of snapshots of one body, each of shape (n, 2), mm.

    The functions of the body at the points, most of the work for a network, are evaluated once for all.
    """
    body, states = snapshots[0].body, np.array([each.state for each in snapshots])
    location = snapshots[0].located(location)
    found, drawn = (
        [],
        zip(body.displacements(states, location), body.gradients(states, location), strict=True),
    )
    for each, (displacement, gradient) in zip(snapshots, drawn, strict=True):
        shift = each.walls.shifts(location, each.changes)
        place = location.points + displacement - np.einsum("nij,nj->ni", gradient[:, :2, :2], shift)
        found.append(each.clamp.moved(place) - location.points)
    return found


def shown_displacements(snapshots: Sequence[Snapshot], location: LocatedPoints) -> list[FloatArray]:
    """What pictures show of `displacements_in_space`, each of shape (n, 2), mm."""
    moved = zip(snapshots, displacements_in_space(snapshots, location), strict=True)
    return [each.pictures.shown(location.points, displacement) for each, displacement in moved]


def gradients(snapshots: Sequence[Snapshot], location: LocatedPoints) -> list[FloatArray]:
    """Gradients by the place before the load of snapshots of one body, each of shape (n, d, d).

    They are in three dimensions, d = 3, on a side face.
    """
    location = snapshots[0].located(location)
    drawn = snapshots[0].body.gradients(np.array([each.state for each in snapshots]), location)
    return [each._gradient(by, location) for each, by in zip(snapshots, drawn, strict=True)]


def von_mises_stresses(snapshots: Sequence[Snapshot], location: LocatedPoints) -> list[FloatArray]:
    """Von Mises stress of snapshots of one body, each of shape (n,), MPa, as `displacements_in_space`."""
    found = zip(snapshots, gradients(snapshots, location), strict=True)
    return [State.from_gradient(gradient, each.problem).von_mises for each, gradient in found]


@dataclass(frozen=True, eq=False)
class Member:
    """The finger by one fit."""

    probability: float  # Of law and side faces
    found: Snapshot  # The finger that was found
    steps: Sequence[Snapshot]  # The finger `STEP` times each of p independent standard errors away
    response: Response
    model: ResponseModel


@dataclass(frozen=True, eq=False)
class IdentifiedField(Snapshot):
    """The displacement by the most probable fit, with deviations.

    They include the distances of the other fits from it.
    """

    members: Sequence[Member]  # The most probable first

    def standard_deviation(self, points: ArrayLike | LocatedPoints) -> FloatArray:
        """Standard deviation of `displacement_in_space` at points (n, 2), mm: shape (n, 2), mm."""
        location = _on(self.problem, points)
        return self._deviation(lambda them: displacements_in_space(them, location))[1]

    def shown_deviation(self, points: ArrayLike | LocatedPoints) -> FloatArray:
        """Standard deviation of what pictures show of the displacement at points (n, 2), mm: (n, 2), mm."""
        location = _on(self.problem, points)
        return self._deviation(lambda them: shown_displacements(them, location))[1]

    def von_mises_deviation(self, points: ArrayLike | LocatedPoints) -> FloatArray:
        """Standard deviation of the von Mises stress at points (n, 2), mm: shape (n,), MPa."""
        location = _on(self.problem, points)
        own, found = self._deviation(lambda them: von_mises_stresses(them, location))
        if not (share := self.members[0].model.doubt.stress):
            return found
        # Over a section bending differs from that of the plane also where the plane has little stress.
        mesh, all_over = self.problem.mesh, own
        if not np.array_equal(location.points, (centroids := mesh.at_centroids()).points):
            (all_over,) = von_mises_stresses([self], centroids)
        return np.hypot(found, share * np.hypot(own, np.sqrt(np.average(all_over**2, weights=mesh.areas))))

    def _deviation(
        self, quantities: Callable[[Sequence[Snapshot]], list[FloatArray]]
    ) -> tuple[FloatArray, FloatArray]:
        """A quantity, a function of snapshots of one body, by the best fit, and its standard deviation."""
        best: FloatArray | None = None
        variance: FloatArray | float = 0.0
        for member in self.members:
            own, *steps = quantities([member.found, *member.steps])
            best = own if best is None else best
            spread = sum(((step - own) / STEP) ** 2 for step in steps)
            variance = variance + member.probability * (spread + (own - best) ** 2)
        return np.asarray(best), np.sqrt(variance)


@dataclass(frozen=True, eq=False)
class IdentifiedSideFace(IdentifiedField):
    """That of a side face; it is a `SolidField`."""

    def solid_gradient(self, location: LocatedPoints) -> FloatArray:
        """Gradient of the displacement by the place before the load, shape (n, 3, 3)."""
        return gradients([self], location)[0]


def _on(problem: Problem, points: ArrayLike | LocatedPoints) -> LocatedPoints:
    return points if isinstance(points, LocatedPoints) else problem.mesh.locate(points)
