"""Equilibria of a finger under a hypothesis, the markers there, and exact derivatives by the unknowns.

With the traction's rows b, the force f and the couple m, equilibrium is F(c, θ) = f · b + m · ∂b/∂x, where x
is the place of the contact; with the tangent K there,

    K c' = (f · b + m · ∂b/∂x)' - ∂F/∂θ

A marker is at a fixed place P of the drawn body; where the walls have moved by W, the material there was
drawn at P - W, so that it moves by u(P) - ∇u(P) W(P) to first order in W, and with the clamp on top.
"""

from dataclasses import dataclass, replace

import numpy as np

from geometry.arrays import FloatArray
from geometry.errors import UserError
from solvers.assimilation.misfit import Misfit
from solvers.constrained_elimination import ConstrainedElimination
from solvers.identification.body import Body, Linearised
from solvers.identification.clamp import Clamp, RigidMotion
from solvers.identification.hypothesis import Hypothesis, Unknowns

MAX_ITERATIONS = 8
"""Newton iterations before a guess counts as too far away."""
MOST_ITERATIONS = 20
"""The same from the state of another body, beyond which there is no other way."""
FAR = 0.1
"""Relative size of a Newton step above which the steps must not grow, or the guess is too far away."""
ROUGH, EXACT = 2e-3, 1e-6
"""Relative size of the last Newton step, in the energy norm, while unknowns are sought and at the end."""
SHORTEST = 2.0**-6
"""Fraction of a Newton step below which it is not shortened, lest it turn an element inside out."""
REST = 1e-10
"""Least work of a load to compare a step with, N mm/mm: that of moving a finger by some ten nanometres."""
HALVINGS = 4
"""Times that the way from the last hypothesis to the next one is halved where no equilibrium is found."""


@dataclass(frozen=True, eq=False)
class Response:
    """An equilibrium with its derivatives by p unknowns.

    Attributes:
        values: Of the unknowns, shape (p,).
        hypothesis: What they describe.
        state: c.
        slopes: c', shape (p, *shape).
        motion: Of the clamp.
        motion_slopes: Derivatives of its shift, (p, 2), and angle, (p,).
        contact: Mean displacement of the contact, shape (2,), mm.
        contact_slopes: Shape (p, 2).
    """

    values: FloatArray
    hypothesis: Hypothesis
    state: FloatArray
    slopes: FloatArray
    motion: RigidMotion
    motion_slopes: tuple[FloatArray, FloatArray]
    contact: FloatArray
    contact_slopes: FloatArray


class ResponseModel:
    """Responses of a body; each starts from the last one.

    Args:
        body: The discretised finger.
        unknowns: The unknowns.
    """

    def __init__(self, body: Body, unknowns: Unknowns) -> None:
        self.body, self.unknowns = body, unknowns
        self._clamp = Clamp.of(unknowns.problem.mesh)
        self._last: Response | None = None
        self.evaluations = 0

    def flexibility(self) -> float:
        """Displacement of the drawn contact into the finger under a unit force, mm per N/mm."""
        middle, width = self.unknowns.place
        lame = self.unknowns.problem.material.lame
        still = self.body.linearised(
            np.zeros(self.body.shape), lame, np.zeros(len(self.unknowns.motion.names))
        )
        if still is None:
            raise UserError("the finger is inside out before it is loaded")
        rows = self._traction(middle, width)[0]
        pressed = np.tensordot(self.unknowns.directions[0], rows, axes=1)
        return float((pressed * still.solve(pressed[None])[0]).sum())

    def response(self, values: FloatArray, tolerance: float = ROUGH) -> Response | None:
        """The response at values of the unknowns, shape (p,); None if no equilibrium is found on the way.

        Args:
            values: Shape (p,).
            tolerance: `ROUGH` or `EXACT`.
        """
        self.evaluations += 1
        found = self._reached(values, tolerance, HALVINGS)
        if found is not None:
            self._last = found
        return found

    def equilibrium(self, near: Response) -> Response | None:
        """The response at another one's values, from its state alone, which may be that of another body.

        Returns:
            None if Newton's method does not converge in `MOST_ITERATIONS`.
        """
        self.evaluations += 1
        self._last = near
        found = self._near(near.values, ROUGH, MOST_ITERATIONS)
        self._last = found or near
        return found

    def unstable(self, response: Response) -> int:
        """Number of directions in which the energy falls while the mean of the contact is held still."""
        hypothesis = response.hypothesis
        there = self.body.linearised(response.state, hypothesis.lame, hypothesis.changes)
        if there is None:
            raise UserError("the finger that was found is inside out")
        rows = self._traction(hypothesis.position, hypothesis.width)[0]
        held = ConstrainedElimination(rows, there.solve(rows))
        return held.unstable(there.negative)

    def restart(self, response: Response | None) -> None:
        """Start the next response from this one; None: from rest."""
        self._last = response

    def extrapolated(self, about: Response, values: FloatArray) -> Response:
        """The response at values of the unknowns, shape (p,), to first order about another one."""
        step = values - about.values
        shifts, turns = about.motion_slopes
        motion = replace(
            about.motion,
            shift=about.motion.shift + step @ shifts,
            turn=about.motion.turn + float(step @ turns),
        )
        return replace(
            about,
            values=values.copy(),
            hypothesis=self.unknowns.hypothesis(values),
            state=about.state + np.tensordot(step, about.slopes, axes=1),
            motion=motion,
            contact=about.contact + step @ about.contact_slopes,
        )

    def _reached(self, values: FloatArray, tolerance: float, halvings: int) -> Response | None:
        found = self._near(values, tolerance)
        if found is not None or not halvings:
            return found
        before = self._last
        start = self._rest() if before is None else before.values
        self._last = self._reached(0.5 * (start + values), ROUGH, halvings - 1)
        if self._last is None:
            self._last = before
            return None
        found = self._reached(values, tolerance, halvings - 1)
        if found is None:
            self._last = before
        return found

    def _rest(self) -> FloatArray:
        """Values without a force, shape (p,), other unknowns as expected."""
        return np.array([parameter.start for parameter in self.unknowns.parameters(1.0)])

    def _near(
        self, values: FloatArray, tolerance: float, iterations: int = MAX_ITERATIONS
    ) -> Response | None:
        """By Newton's method from the last response along its derivatives."""
        hypothesis = self.unknowns.hypothesis(values)
        state = np.zeros(self.body.shape)
        if self._last is not None:
            state = self._last.state + np.tensordot(values - self._last.values, self._last.slopes, axes=1)
        traction = self._traction(hypothesis.position, hypothesis.width)
        load = np.tensordot(hypothesis.force, traction[0], axes=1)
        load += np.tensordot(hypothesis.couple, traction[1], axes=1)
        before, step = np.inf, np.zeros(self.body.shape)
        for _ in range(iterations):
            length = 1.0
            while True:
                linearised = self.body.linearised(state + length * step, hypothesis.lame, hypothesis.changes)
                if linearised is not None or length < SHORTEST or not step.any():
                    break
                length /= 2
            if linearised is None:
                return None
            state = state + length * step
            balance = load - linearised.force
            step = linearised.solve(balance[None])[0]
            work = max(abs(float((load * state).sum())), REST)
            size = float(np.sqrt(abs((step * balance).sum()) / work)) if balance.any() else 0.0
            if not np.isfinite(size) or size > max(before, FAR):
                return None
            if size < tolerance:
                return self._with_slopes(values, hypothesis, (state + step, state), linearised, traction)
            before = size
        return None

    def _with_slopes(
        self,
        values: FloatArray,
        hypothesis: Hypothesis,
        states: tuple[FloatArray, FloatArray],
        linearised: Linearised,
        traction: FloatArray,
    ) -> Response:
        """The response at the first of two states or, where that turns a point inside out, at the second."""
        unknowns, names = self.unknowns, self.unknowns.names
        state, before = states
        of_walls, of_moduli = self.body.force_slopes(state, hypothesis.lame, hypothesis.changes)
        if not (np.isfinite(of_walls).all() and np.isfinite(of_moduli).all()):
            state = before
            of_walls, of_moduli = self.body.force_slopes(state, hypothesis.lame, hypothesis.changes)
        force_slopes = unknowns.force_slopes()
        right = np.tensordot(force_slopes, traction[0], axes=1)
        right += np.tensordot(unknowns.couple_slopes(values), traction[1], axes=1)
        for name, moved, turned in zip(("position", "width"), traction[1:3], traction[3:], strict=True):
            if name in names:
                right[names.index(name)] += np.tensordot(hypothesis.force, moved, axes=1)
                right[names.index(name)] += np.tensordot(hypothesis.couple, turned, axes=1)
        for name, slope in zip(unknowns.motion.names, of_walls, strict=True):
            if name in names:
                right[names.index(name)] -= slope
        right -= np.tensordot(unknowns.moduli_slopes(values), of_moduli, axes=1)
        slopes = linearised.solve(right)
        contact, contact_slopes = self._contact(hypothesis, traction, state, slopes)
        place, place_slopes = self._place(hypothesis, contact, contact_slopes)
        motion = self._clamp.motion(hypothesis.softness, hypothesis.force, place)
        motion_slopes = self._clamp.slopes(
            hypothesis.softness,
            hypothesis.force,
            place,
            unknowns.softness_slopes(values),
            force_slopes,
            place_slopes,
        )
        return Response(
            values.copy(), hypothesis, state, slopes, motion, motion_slopes, contact, contact_slopes
        )

    def _traction(self, position: float, width: float) -> FloatArray:
        """Rows (5, 2, *shape) of the traction and its derivatives, as `FrontTraction.weights` has them."""
        front = self.unknowns.traction
        return self.body.displacement_rows(front.points, front.weights(position, width))

    def _contact(
        self, hypothesis: Hypothesis, traction: FloatArray, state: FloatArray, slopes: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Mean displacement of the contact, (2,), mm, and its derivatives (p, 2)."""
        axes = tuple(range(2, traction.ndim))
        inner = tuple(range(state.ndim))
        mean, by_position, by_width = np.tensordot(traction[:3], state, axes=(axes, inner))
        each = tuple(axis + 1 for axis in inner)
        found = np.tensordot(slopes, traction[0], axes=(each, each))
        for name, change in (("position", by_position), ("width", by_width)):
            if name in self.unknowns.names:
                found[self.unknowns.names.index(name)] += change
        return mean, found

    def _place(
        self, hypothesis: Hypothesis, contact: FloatArray, contact_slopes: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Deformed middle of the contact, (2,), mm, and its derivatives (p, 2)."""
        front = self.unknowns.traction
        rows = front.weights(hypothesis.position, hypothesis.width) @ front.points
        found = contact_slopes.copy()
        for name, change in (("position", rows[1]), ("width", rows[2])):
            if name in self.unknowns.names:
                found[self.unknowns.names.index(name)] += change
        return rows[0] + contact, found


@dataclass(frozen=True, eq=False)
class MarkerModel:
    """The displacements of m markers in a response.

    Attributes:
        centres: Of the markers at rest, shape (m, 2), mm.
        rows: Of their mean displacement in the drawn body, shape (m, 2, *shape).
        wall_rows: Of its change by the motion of each wall, shape (k, m, 2, *shape), per mm.
        unknowns: The unknowns.
    """

    centres: FloatArray
    rows: FloatArray
    wall_rows: FloatArray
    unknowns: Unknowns

    @classmethod
    def of(cls, body: Body, unknowns: Unknowns, misfit: Misfit) -> "MarkerModel":
        """Of the markers of a misfit."""
        points, means = misfit.sampling()
        location = unknowns.problem.mesh.locate(points)
        count = len(unknowns.motion.names)
        moved = [unknowns.motion.shifts(location, one) for one in np.eye(count)]
        rows = body.displacement_rows(points, means)
        wall_rows = [-body.gradient_rows(points, means[:, :, None] * shift) for shift in moved]
        return cls(misfit.points, rows, np.array(wall_rows).reshape(count, *rows.shape), unknowns)

    def predicted(self, response: Response) -> tuple[FloatArray, FloatArray]:
        """Displacements u v u v ..., shape (2 m,), mm, and their derivatives (2 m, p)."""
        changes = response.hypothesis.changes
        rows = self.rows + np.tensordot(changes, self.wall_rows, axes=1)
        inner = tuple(range(2, rows.ndim))
        last = tuple(range(1, response.slopes.ndim))
        drawn = np.tensordot(rows, response.state, axes=(inner, tuple(range(response.state.ndim))))
        slopes = np.tensordot(response.slopes, rows, axes=(last, inner))
        names = self.unknowns.names
        for name, row in zip(self.unknowns.motion.names, self.wall_rows, strict=True):
            if name in names:
                slopes[names.index(name)] += np.tensordot(
                    row, response.state, axes=(inner, tuple(range(response.state.ndim)))
                )
        places = self.centres + drawn
        moved = response.motion.moved(places) - self.centres
        moved_slopes = response.motion.slopes(places, slopes, *response.motion_slopes)
        return moved.ravel(), moved_slopes.reshape(len(moved_slopes), -1).T
