"""Equilibria of a finger under a hypothesis, the markers there, and exact derivatives by the unknowns.

With the traction's rows b, the force f and the couple m, equilibrium is F(c, θ) = f · b + m · ∂b/∂x, where x
is the place of the contact; with the tangent K there,

    K c' = (f · b + m · ∂b/∂x)' - ∂F/∂θ

where the base is held; at its feet c' is their motion, and ∂F/∂θ the force of that alone. Where the unknowns
have an indentation d in place of the normal force N, with a load N p + q, N follows from n · b · c = d:

    ΔN = (d - n · b · (c + Δc)) / (n · b · K⁻¹ p)        Δc = K⁻¹ (N p + q - F)

which has a solution where K is singular, too: where N is largest, and beyond.

A marker is at a fixed place P of the drawn body; where the walls have moved by W, the material there was
drawn at P - W, so that it moves by u(P) - ∇u(P) W(P) to first order in W, and with the clamp on top.
`pinnray.geometry.picture_frame` has what pictures show of that whose frames are unknown.
"""

from dataclasses import dataclass, replace
from math import log

import numpy as np

from pinnray.geometry.observations import Observations
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.assimilation.estimation import GrossErrors, Prediction
from pinnray.solvers.assimilation.misfit import disc_quadrature, radius_within, standard_deviations
from pinnray.solvers.assimilation.picture_frames import pictures_of
from pinnray.solvers.constrained_elimination import ConstrainedElimination
from pinnray.solvers.identification.body import Body, Linearised
from pinnray.solvers.identification.boundary import Clamp, RigidMotion
from pinnray.solvers.identification.unknowns import Doubt, Hypothesis, Unknowns
from pinnray.solvers.identification.way_point import WayPoint
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import stroke_axes
from pinnray.solvers.solver import NoSolutionError

MAX_ITERATIONS, HALVINGS = 8, 4
"""Newton iterations before a guess counts as too far away; times that the way there is then halved."""
ROUGH, EXACT = 2e-3, 1e-6
"""Relative size of the last Newton step, in the energy norm, while unknowns are sought and at the end."""
WRONG, OFF = 100.0, 1.0
"""Markers of which one is not where it seems to be, and the size of its error, mm, or far more."""


@dataclass(frozen=True, eq=False)
class Response:
    """An equilibrium with its derivatives by p unknowns."""

    values: FloatArray  # Of the unknowns, shape (p,)
    hypothesis: Hypothesis  # Finger and contact of the values
    state: FloatArray  # c
    slopes: FloatArray  # c', shape (p, *shape)
    motion: RigidMotion  # Of the clamp
    force: FloatArray  # Of the indenter per depth, shape (2,), N/mm
    force_slopes: FloatArray  # Shape (p, 2)
    place: float  # Abscissa on the drawn front at which it acts, mm
    place_slopes: FloatArray  # Shape (p,)
    way: tuple[WayPoint, ...] = ()  # Of a cylinder, from its first stage to this equilibrium


class ResponseModel:
    """Responses of a discretised finger to the unknowns; each starts from the last one.

    Args:
        body: The finger.
        unknowns: Their values are what it responds to.
        weighed: Whether plane strain and free side faces are weighed by the markers.
    """

    def __init__(self, body: Body, unknowns: Unknowns, *, weighed: bool = False) -> None:
        self.body, self.unknowns = body, unknowns
        self.doubt = Doubt.of(unknowns.problem, weighed=weighed)
        self._clamp = Clamp(unknowns.problem.mesh)
        self._last: Response | None = None
        self._marker_rows: dict[tuple[bytes, float], tuple[FloatArray, FloatArray]] = {}
        self.evaluations = 0

    def flexibility(self) -> float:
        """Displacement of the drawn contact into the finger under a unit force, mm per N/mm."""
        still = np.zeros(len(self.unknowns.motion.names))
        rest = self.body.linearised(np.zeros(self.body.shape), self.unknowns.problem.material.lame, still)
        if rest is None:
            raise NoSolutionError("the finger is inside out before it is loaded")
        rows = self._traction(*self.unknowns.place)[0]
        pressed = np.tensordot(self.unknowns.directions[0], rows, axes=1)
        return float((pressed * rest.solve(pressed[None])[0]).sum())

    def response(
        self,
        values: FloatArray,
        tolerance: float = ROUGH,
        *,
        iterations: int = MAX_ITERATIONS,
        halvings: int = HALVINGS,
        slopes: FloatArray | None = None,
    ) -> Response | None:
        """The response at values of the unknowns, shape (p,); None if no equilibrium is found on the way.

        Args:
            values: Of the unknowns, shape (p,).
            tolerance: `ROUGH` or `EXACT`.
            iterations: Newton iterations from one hypothesis to the next.
            halvings: Times that the way is halved where no equilibrium is found.
            slopes: Derivatives to take in place of computed ones, shape (p, *shape).
        """
        self.evaluations += 1
        found = self._reached(values, tolerance, iterations, halvings, slopes)
        if found is not None:
            self._last = found
        return found

    def unstable(self, response: Response) -> int:
        """Number of directions in which the energy falls while the contact is held still."""
        hypothesis = response.hypothesis
        there = self.body.linearised(response.state, hypothesis.lame, hypothesis.changes)
        if there is None:
            raise NoSolutionError("the finger that was found is inside out")
        rows, negative = self._held(response), there.negative()
        return ConstrainedElimination(rows, there.solve(rows)).unstable(negative)

    def _held(self, response: Response) -> FloatArray:
        """Rows of what the contact holds still, (k, *shape)."""
        return np.asarray(self._traction(response.hypothesis.position, response.hypothesis.width)[0])

    def restart(self, response: Response | None) -> None:
        """Start the next response from this one, also by another body; None: from rest."""
        self._last = response

    def extrapolated(self, about: Response, values: FloatArray) -> Response:
        """The response at values of the unknowns, shape (p,), to first order about another one."""
        step = values - about.values
        force = about.force + step @ about.force_slopes
        return replace(
            about,
            values=values.copy(),
            hypothesis=self.unknowns.hypothesis(values, float(force @ self.unknowns.directions[0])),
            state=about.state + np.tensordot(step, about.slopes, axes=1),
            motion=about.motion.extrapolated(step),
            force=force,
            place=about.place + float(step @ about.place_slopes),
        )

    def marker_rows(self, points: FloatArray, radius: float) -> tuple[FloatArray, FloatArray]:
        """The rows of `MarkerModel` for markers at points (m, 2), mm; the last ones are kept."""
        if (key := (points.tobytes(), radius)) not in self._marker_rows:
            self._marker_rows = {key: self._rows_of_markers(points, radius)}
        return self._marker_rows[key]

    def _rows_of_markers(self, points: FloatArray, radius: float) -> tuple[FloatArray, FloatArray]:
        points, means = disc_quadrature(points, radius)
        body, motion = self.body, self.unknowns.motion
        location = self.unknowns.problem.mesh.locate(points)
        shifts = [motion.shifts(location, one) for one in np.eye(len(motion.names))]
        rows = body.displacement_rows(points, means)
        moved_rows = [-body.gradient_rows(points, means[:, :, None] * shift) for shift in shifts]
        if any(name.startswith("drawn") for name in self.unknowns.names):
            still = pictures_of(self.unknowns.centre, {}).drawn
            moved_rows += [body.gradient_rows(points, means[:, :, None] * by) for by in still.slopes(points)]
        return rows, np.array(moved_rows).reshape(-1, *rows.shape)

    def _reached(
        self, values: FloatArray, tolerance: float, iterations: int, halvings: int, slopes: FloatArray | None
    ) -> Response | None:
        """The response, by way of those halfway where it is too far from the last one."""
        found, before = self._near(values, tolerance, iterations, slopes), self._last
        # At rest there is no force, and the other unknowns are as expected.
        rest = np.array([parameter.start for parameter in self.unknowns.parameters(1.0)])
        start = rest if before is None else before.values
        if found is not None or not halvings or (start == values).all():
            return found
        self._last = self._reached(0.5 * (start + values), ROUGH, iterations, halvings - 1, slopes)
        if self._last is not None:
            found = self._reached(values, tolerance, iterations, halvings - 1, slopes)
        if found is None:
            self._last = before
        return found

    def _near(
        self, values: FloatArray, tolerance: float, iterations: int, slopes: FloatArray | None
    ) -> Response | None:
        """The response by Newton's method from the last one, extrapolated along its derivatives."""
        state, normal, by_normal = np.zeros(self.body.shape), 0.0, np.zeros(len(values))
        if (last := self._last) is not None:
            there, by_normal = values - last.values, last.force_slopes @ self.unknowns.directions[0]
            state = last.state + np.tensordot(there, last.slopes, axes=1)
            normal = float(last.force @ self.unknowns.directions[0] + there @ by_normal)
        hypothesis = self.unknowns.hypothesis(values)
        feet = self.body.feet
        state = np.where(feet.any(axis=0), np.tensordot(hypothesis.feet, feet, axes=1), state)
        traction = self._traction(hypothesis.position, hypothesis.width)
        load = self._load(hypothesis, traction)
        push = self._load(self.unknowns.hypothesis(values, 1.0), traction) - load  # zero if N is given
        into = np.tensordot(self.unknowns.directions[0], traction[0], axes=1)
        before, step = np.inf, np.zeros(self.body.shape)
        for _ in range(iterations):
            length = 1.0
            while True:  # a shorter step where a whole one turns an element inside out
                linearised = self.body.linearised(state + length * step, hypothesis.lame, hypothesis.changes)
                if linearised is not None or length < 2.0**-6 or not step.any():
                    break
                length /= 2
            if linearised is None:
                return None
            state = state + length * step
            balance = load + normal * push - linearised.force
            if push.any():
                free, pushed = linearised.solve(np.stack([balance, push]))
                gap = hypothesis.indentation - float((into * (state + free)).sum())
                more = gap / float((into * pushed).sum())
                normal, balance, step = normal + more, balance + more * push, free + more * pushed
            else:
                step = linearised.solve(balance[None])[0]
            # The least work, N mm/mm, moves a finger by some ten nanometres.
            work = max(abs(float(((load + normal * push) * state).sum())), 1e-10)
            size = float(np.sqrt(abs((step * balance).sum()) / work)) if balance.any() else 0.0
            # Large steps must not grow: the guess is too far away.
            if not np.isfinite(size) or size > max(before, 0.1):
                return None
            if size < tolerance:
                if self.body.admissible(state + step, hypothesis.changes):
                    state = state + step
                if slopes is None:
                    slopes, by_normal = self._slopes(values, normal, state, linearised, traction, push)
                return self._response(values, (normal, by_normal), state, slopes, traction)
            before = size
        return None

    def _load(self, hypothesis: Hypothesis, traction: FloatArray) -> FloatArray:
        """The load of a contact, of the shape of a state."""
        along = np.tensordot(hypothesis.force, traction[0], axes=1)
        return np.asarray(along + np.tensordot(hypothesis.couple, traction[1], axes=1))

    def _slopes(
        self,
        values: FloatArray,
        normal: float,
        state: FloatArray,
        linearised: Linearised,
        traction: FloatArray,
        push: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """C' and the derivatives of N, shape (p,), at a state."""
        hypothesis, slope = self.unknowns.hypothesis(values, normal), self.unknowns.slopes(values, normal)
        force, couple = hypothesis.force, hypothesis.couple
        parts = self.body.force_slopes(state, hypothesis.lame, hypothesis.changes)
        right = np.tensordot(slope.force, traction[0], axes=1)
        right += np.tensordot(slope.couple, traction[1], axes=1)
        for by, moved, turned in zip((slope.position, slope.width), traction[1:3], traction[3:], strict=True):
            change = np.tensordot(force, moved, axes=1) + np.tensordot(couple, turned, axes=1)
            right += np.multiply.outer(by, change)
        for by, part in zip((slope.changes, slope.moduli, slope.feet), parts, strict=True):
            right -= np.tensordot(by, part, axes=1)
        held = np.tensordot(slope.feet, self.body.feet, axes=1)
        if not push.any():
            return linearised.solve(right) + held, np.zeros(len(values))
        *free, pushed = linearised.solve(np.concatenate([right, push[None]]))
        free = np.asarray(free) + held
        rows = np.tensordot(self.unknowns.directions[0], traction[:3], axes=(0, 1))
        _, by_position, by_width = np.tensordot(rows, state, axes=state.ndim)
        gaps = slope.indentation - slope.position * by_position - slope.width * by_width
        gaps -= np.tensordot(free, rows[0], axes=state.ndim)
        by_normal = gaps / float((rows[0] * pushed).sum())
        return free + np.multiply.outer(by_normal, pushed), by_normal

    def _response(
        self,
        values: FloatArray,
        normal: tuple[float, FloatArray],
        state: FloatArray,
        slopes: FloatArray,
        traction: FloatArray,
    ) -> Response:
        """The response at a state; the normal force comes with its derivatives."""
        hypothesis, slope = self.unknowns.hypothesis(values, normal[0]), self.unknowns.slopes(values, *normal)
        force = hypothesis.force
        inner = tuple(range(1, slopes.ndim))
        front = self.unknowns.traction
        places = front.weights(hypothesis.position, hypothesis.width)[:3] @ front.points
        place, by_position, by_width = places + np.tensordot(traction[:3], state, axes=state.ndim)
        place_slopes: FloatArray = np.tensordot(slopes, traction[0], axes=(inner, inner))
        place_slopes += np.outer(slope.position, by_position) + np.outer(slope.width, by_width)
        softness = hypothesis.softness, slope.softness
        motion = self._clamp.motion(softness, (force, slope.force), (place, place_slopes))
        return Response(
            values.copy(),
            hypothesis,
            state,
            slopes,
            motion,
            force,
            slope.force,
            hypothesis.position + hypothesis.eccentricity,
            slope.position + slope.eccentricity,
        )

    def _traction(self, position: float, width: float) -> FloatArray:
        """Rows (5, 2, *shape) of the traction and its derivatives; see `FrontTraction.weights`."""
        front = self.unknowns.traction
        return self.body.traction_rows(front.points, front.weights(position, width))


@dataclass(frozen=True, eq=False)
class MarkerData:
    """Displacements of m markers and, if it was weighed, the force."""

    points: FloatArray  # Markers at rest, shape (m, 2), mm
    displacements: FloatArray  # Shape (m, 2), mm
    deviations: FloatArray  # Their standard deviations, shape (m, 2), mm
    radius: float  # Of the discs over which the displacement is averaged, mm
    # Force of the indenter along its stroke per depth, with its standard deviation, N/mm
    force: tuple[float, float] | None = None

    @classmethod
    def of(cls, problem: Problem, observations: Observations, radius: float | None) -> "MarkerData":
        """All markers that were seen; see `MarkerSettings.marker_radius` for the radius, mm."""
        seen, force = observations.visible, observations.weighed
        points = observations.points[seen]
        if not len(points):
            raise UserError("there are no markers to find a force by")
        if force is not None:
            if problem.finger is None:
                raise UserError(
                    "a weighed force is that of a finger with a depth: give the problem its finger"
                )
            force = force[0] / problem.finger.depth, force[1] / problem.finger.depth
        radius = observations.marker_radius if radius is None else radius
        moved, radius = observations.displacements[seen], radius_within(problem.mesh, points, radius)
        return cls(points, moved, standard_deviations(observations), radius, force)

    @property
    def errors(self) -> GrossErrors:
        """Markers that may be elsewhere."""
        rows = np.arange(2 * len(self.points)).reshape(-1, 2)
        return GrossErrors(rows, np.log(self.deviations / OFF).sum(axis=1) - log(WRONG))

    @property
    def observed(self) -> FloatArray:
        """Displacements u v u v ..., then the force if it was weighed."""
        return np.append(self.displacements.ravel(), self.force[:1] if self.force else [])

    @property
    def noise(self) -> FloatArray:
        """Standard deviations of `observed`."""
        return np.append(self.deviations.ravel(), self.force[1:] if self.force else [])


class MarkerModel:
    """The values of a measurement as a function of a response of a finger.

    Attributes:
        rows: Of the markers' mean displacement in the drawn body, shape (m, 2, *shape).
        moved_rows: Of its change by what moves a marker in the body, shape (k, m, 2, *shape): the motion of
            each wall, per mm, and the values of the homography between picture and drawing, if it is unknown.
    """

    def __init__(self, model: ResponseModel, measurement: MarkerData) -> None:
        self.measurement, self.unknowns = measurement, model.unknowns
        self.rows, self.moved_rows = model.marker_rows(measurement.points, measurement.radius)

    def predicted(self, response: Response) -> Prediction:
        """Values in the order of `MarkerData.observed`, shape (n,), and their derivatives (n, p)."""
        hypothesis, state, slopes = response.hypothesis, response.state, response.slopes
        by = self.unknowns.slopes(response.values)
        points = self.measurement.points
        pressed, drawing = hypothesis.pictures.pressed, hypothesis.pictures.drawn
        count = len(self.moved_rows)
        moves = np.append(hypothesis.changes, drawing.values)[:count]
        by_moves = np.concatenate([by.changes, by.drawn], axis=1)[:, :count]
        rows = self.rows + np.tensordot(moves, self.moved_rows, axes=1)
        drawn = np.tensordot(rows, state, axes=state.ndim)
        axes = tuple(range(1, slopes.ndim)), tuple(range(2, rows.ndim))
        drawn_slopes = np.tensordot(slopes, rows, axes=axes)
        drawn_slopes += np.tensordot(by_moves, np.tensordot(self.moved_rows, state, axes=state.ndim), axes=1)
        drawn_slopes += np.tensordot(by.drawn, drawing.slopes(points), axes=1)
        places = drawing.moved(points) + drawn
        seen = drawing.undone(response.motion.moved(places))  # in the frame of the picture at rest
        seen_slopes = response.motion.slopes(places, drawn_slopes)
        seen_slopes -= np.tensordot(by.drawn, drawing.slopes(seen), axes=1)
        seen_slopes = np.einsum("mij,pmj->pmi", hypothesis.pictures.jacobians(seen), seen_slopes)
        seen_slopes += np.tensordot(by.pressed, pressed.slopes(seen), axes=1)
        values = (pressed.moved(seen) - points).ravel()
        derivatives = seen_slopes.reshape(len(seen_slopes), -1).T
        if self.measurement.force is None:
            return values, derivatives
        stroke, _ = stroke_axes(self.unknowns.problem.load)
        derivatives = np.vstack([derivatives, response.force_slopes @ stroke])
        return np.append(values, response.force @ stroke), derivatives
