"""Equilibria of a finger that a rigid cylinder presses, with friction, on the way to its full travel.

Friction depends on the way there: each response has the stages of its own, and the next one starts every
stage from them, extrapolated along their derivatives. These are exact, from stage to stage, with what
touches, sticks and slips held.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.sparse import csr_matrix

from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.solvers.contact.cylinder import Cylinder
from pinnray.solvers.contact.front_contact import FrontContact
from pinnray.solvers.identification.body import Body, PressedBody
from pinnray.solvers.identification.model import Response, ResponseModel
from pinnray.solvers.identification.unknowns import Hypothesis, HypothesisSlopes, Unknowns
from pinnray.solvers.identification.way_point import WayPoint

NEAR = 0.04
"""Gap over the radius from which on a point is not asked whether it touches in a Newton iteration."""
FARTHEST = 2.0
"""Longest step of Newton's method over the travel of the stage; a longer one leads astray."""
ALMOST = 0.015
"""Largest step, relative in the energy norm, that is the last one while unknowns are sought: the error that
it leaves is about its square."""
ITERATIONS, HALVINGS = 15, 3
"""Newton iterations of a stage, and times that the way to it is halved where they do not settle."""


class CylinderModel(ResponseModel):
    """Responses of a discretised finger to the unknowns of a cylinder; see `ResponseModel`."""

    def __init__(self, body: PressedBody, unknowns: Unknowns, *, weighed: bool = False) -> None:
        super().__init__(body, unknowns, weighed=weighed)
        self._points = body.front
        rows = body.traction_rows(self._points, np.eye(len(self._points)))
        self._rows = csr_matrix(rows.reshape(2 * len(self._points), -1))

    def _held(self, response: Response) -> FloatArray:
        """What touches is held along the normal, and what sticks altogether."""
        cylinder, forces = self._cylinder(response.hypothesis, 1.0), response.way[-1].forces
        axes = cylinder.axes(self._moved(response.state))
        q, t = (forces * axes).sum(axis=2)
        sticks = np.abs(t) < (1 - 1e-6) * cylinder.friction * q  # a point that slips has all of it
        ways = np.concatenate([_along(axes[0], q > 0), _along(axes[1], sticks)])
        return np.asarray((ways @ self._rows).reshape(-1, *self.body.shape))

    def carried(
        self, response: Response, points: FloatArray, finer: Callable[[FloatArray], FloatArray]
    ) -> Response:
        """The response of a coarse model, whose front has the points (n, 2), by these elements.

        Of its stages the last two: the last but one, where slip begins, stays that of the coarse elements.
        """
        order = points[:, 0].argsort()
        units = np.eye(len(points))[order].T
        weights = np.array([np.interp(self._points[:, 0], points[order, 0], unit) for unit in units]).T
        shared = len(points) / len(weights) * weights  # of a force on more points

        def carried(stage: WayPoint, *, final: bool) -> WayPoint:
            state, *slopes = finer(np.stack([stage.state, *stage.slopes]))
            return replace(
                stage,
                state=state,
                forces=shared @ stage.forces,
                places=weights @ stage.places,
                slopes=np.array(slopes),
                force_slopes=shared @ stage.force_slopes,
                place_slopes=stage.place_slopes @ weights.T,
                final=final,
            )

        before, last = carried(response.way[-2], final=True), carried(response.way[-1], final=False)
        return replace(response, state=last.state, slopes=last.slopes, way=(before, last))

    def _reached(
        self, values: FloatArray, tolerance: float, iterations: int, halvings: int, slopes: FloatArray | None
    ) -> Response | None:
        """The response, by way of the stages of the last one."""
        known = () if self._last is None else self._last.way
        step = values if self._last is None else values - self._last.values
        hypothesis, by = self.unknowns.hypothesis(values), self.unknowns.slopes(values)
        way = [self._rest(hypothesis, by)]

        def reached(share: float, near: WayPoint | None, halvings: int) -> bool:
            if near is not None and near.final:
                way.append(near.moved(step))
                return True
            guesses = [self._ahead(way, share)]
            if near is not None:
                guesses.insert(0, near.moved(step))
            for guess in guesses:
                found = self._settled(guess, way[-1], share, hypothesis, by, tolerance)
                if found is not None:
                    way.append(found)
                    return True
            middle = 0.5 * (way[-1].share + share)
            return halvings > 0 and reached(middle, None, halvings - 1) and reached(share, None, halvings - 1)

        equal = np.arange(1, self.unknowns.stages + 1) / self.unknowns.stages
        known_or_none: list[WayPoint | None] = [*known] or [None] * len(equal)
        shares = [each.share for each in known] or equal.tolist()
        if not all(reached(share, near, HALVINGS) for share, near in zip(shares, known_or_none, strict=True)):
            return None
        return self._pressed(values, hypothesis, by, way[1:])

    def _cylinder(self, hypothesis: Hypothesis, share: float) -> Cylinder:
        centre = hypothesis.centre + share * hypothesis.travel
        return Cylinder(self.unknowns.radius, centre, hypothesis.friction)

    def _moved(self, state: FloatArray) -> FloatArray:
        """Places of the front, shape (m, 2), mm."""
        return np.asarray(self._points + (self._rows @ state.ravel()).reshape(-1, 2))

    def _moves(self, states: FloatArray) -> FloatArray:
        """Displacements (p, m, 2) of the front by states (p, *shape)."""
        return np.asarray((self._rows @ states.reshape(len(states), -1).T).T.reshape(len(states), -1, 2))

    def _rest(self, hypothesis: Hypothesis, by: HypothesisSlopes) -> WayPoint:
        cylinder, count = self._cylinder(hypothesis, 0.0), len(self._points)
        still = np.zeros((len(by.friction), count, 2))
        state, slopes = np.zeros(self.body.shape), np.zeros((len(still), *self.body.shape))
        places = cylinder.places(self._points)
        place_slopes = -by.centre @ cylinder.place_slopes(self._points).T
        return WayPoint(0.0, state, still[0], places, slopes, still, place_slopes)

    def _ahead(self, way: list[WayPoint], share: float) -> WayPoint:
        """The last stage or, from the second one on, the state on the line through the last two."""
        last = way[-1]
        if len(way) < 3:
            return last
        ahead = (share - last.share) / (last.share - way[-2].share)
        return replace(last, state=last.state + ahead * (last.state - way[-2].state))

    def _settled(
        self,
        guess: WayPoint,
        before: WayPoint,
        share: float,
        hypothesis: Hypothesis,
        by: HypothesisSlopes,
        tolerance: float,
    ) -> WayPoint | None:
        """The equilibrium at a share of the travel by Newton's method; None where it does not settle."""
        body, cylinder = self.body, self._cylinder(hypothesis, share)
        base = body.feet.any(axis=0)
        state = np.where(base, share * np.tensordot(hypothesis.feet, body.feet, axes=1), guess.state)
        forces = guess.forces
        longest = FARTHEST * (share - before.share) * float(np.linalg.norm(hypothesis.travel))
        for _ in range(ITERATIONS):
            linearised = body.linearised(state, hypothesis.lame, hypothesis.changes)
            if linearised is None:
                return None
            points = self._moved(state)
            near = forces.any(axis=1) | (cylinder.gaps(points) < NEAR * cylinder.radius)
            rows = self._rows[np.repeat(near, 2)]
            asked = np.concatenate([rows.toarray().reshape(-1, *body.shape), linearised.force[None]])
            answers = linearised.solve(asked)
            answers, free = answers[:-1], state - answers[-1]
            compliance = rows @ answers.reshape(len(answers), -1).T
            contact = FrontContact(cylinder, compliance, before.places[near])
            loose = self._moved(free)[near]
            pressed = contact.forces(loose, forces[near])
            if pressed is None:
                return None
            forces = np.zeros_like(forces)
            forces[near] = pressed
            load = (pressed.ravel() @ rows).reshape(body.shape)
            step = free + np.tensordot(pressed.ravel(), answers, axes=1) - state
            if np.abs(step).max() > longest:
                return None
            length = 1.0
            while not body.admissible(state + length * step, hypothesis.changes):
                if (length := length / 2) < 2.0**-6:
                    return None
            work = max(abs(float((load * state).sum())), 1e-10)
            size = float(np.sqrt(abs((step * (load - linearised.force)).sum()) / work))
            state = state + length * step
            inside = cylinder.gaps(self._moved(state))[~near].min(initial=1.0) < 0
            if size < max(tolerance, min(10 * tolerance, ALMOST)) and length == 1 and not inside:
                break
        else:
            return None
        parts = body.force_slopes(state, hypothesis.lame, hypothesis.changes)
        right = np.zeros((len(by.friction), *body.shape))
        for slope, part in zip((by.changes, by.moduli, share * by.feet), parts, strict=True):
            right -= np.tensordot(slope, part, axes=1)
        slopes = linearised.solve(right) + share * np.tensordot(by.feet, body.feet, axes=1)
        centre = by.centre + share * by.travel
        moved = self._moves(slopes)[:, near] - centre[:, None]
        force_slopes = np.zeros((len(slopes), *forces.shape))
        force_slopes[:, near] = contact.slopes(
            loose, pressed, moved, by.friction, before.place_slopes[:, near]
        )
        slopes += np.tensordot(force_slopes[:, near].reshape(len(slopes), -1), answers, axes=1)
        moved = self._moves(slopes) - centre[:, None]
        points = self._moved(state)
        place_slopes = np.einsum("pmi,mi->pm", moved, cylinder.place_slopes(points))
        places = cylinder.places(points)
        return WayPoint(share, state, forces, places, slopes, force_slopes, place_slopes)

    def _pressed(
        self, values: FloatArray, hypothesis: Hypothesis, by: HypothesisSlopes, way: list[WayPoint]
    ) -> Response:
        last, into = way[-1], self.unknowns.directions[0]
        force, force_slopes = last.forces.sum(axis=0), last.force_slopes.sum(axis=1)
        # Points weigh in the place by the force into the finger; without contact there is none.
        total = float(force @ into) or 1.0
        weights = last.forces @ into / total
        weight_slopes = (last.force_slopes @ into - np.outer(force_slopes @ into, weights)) / total
        there, moved = self._moved(last.state), self._moves(last.slopes)
        there_slopes = weight_slopes @ there + np.einsum("m,pmi->pi", weights, moved)
        softness, x = (hypothesis.softness, by.softness), self._points[:, 0]
        motion = self._clamp.motion(softness, (force, force_slopes), (weights @ there, there_slopes))
        return Response(
            values.copy(),
            hypothesis,
            last.state,
            last.slopes,
            motion,
            force,
            force_slopes,
            float(weights @ x),
            weight_slopes @ x,
            tuple(way),
        )


def response_model(body: Body, unknowns: Unknowns, *, weighed: bool) -> ResponseModel:
    """The model of the contact that the unknowns have."""
    if "travel" not in unknowns.names:
        return ResponseModel(body, unknowns, weighed=weighed)
    assert isinstance(body, PressedBody)  # of finite elements
    return CylinderModel(body, unknowns, weighed=weighed)


def _along(ways: FloatArray, held: BoolArray) -> FloatArray:
    """Rows (k, 2 m) of the displacement along directions (m, 2) of the k points of a mask."""
    rows = np.eye(len(held))[held]
    return (rows[:, :, None] * ways).reshape(len(rows), 2 * len(ways))
