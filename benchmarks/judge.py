"""The default finger, and how far a displacement field is from graded finite elements."""

import time
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from compare.evaluation.differences import field_difference
from compare.evaluation.evaluation import Evaluation
from geometry.cache import finger_mesh
from geometry.finger.design import Design
from geometry.mesh.quadrature import body_quadrature
from geometry.mesh.settings import MeshSettings
from geometry.mesh.triangle_mesh import TriangleMesh
from solvers.fem.linear import FemSolver
from solvers.problem import Load, Problem
from solvers.solution import DisplacementField, State

CORNER_SIZE = 0.02
"""Elements of the reference at the corners, mm."""


class Judged(NamedTuple):
    """A field against the reference.

    Attributes:
        seconds: Time that its training took, without the judging.
        displacement: Relative L2 error, %.
        von_mises: Relative L2 error, %.
        energy: Elastic energy over the reference's, minus one, %.
    """

    seconds: float
    displacement: float
    von_mises: float
    energy: float


@dataclass(frozen=True, eq=False)
class Judge:
    """Quadratic finite elements of the default finger under a load, graded to its corners.

    Attributes:
        load: The load.
        mesh: Where fields are compared: the shared mesh.
    """

    load: Load
    mesh: TriangleMesh

    @classmethod
    def of(cls, load: Load | None = None) -> "Judge":
        """For a load; the default one if None."""
        return cls(load or Load(), finger_mesh(Design()))

    @cached_property
    def problem(self) -> Problem:
        """What is solved."""
        return Problem(self.mesh, load=self.load)

    def prepare(self) -> None:
        """Find the reference."""
        self._reference  # noqa: B018 (cached)

    @cached_property
    def _reference(self) -> Evaluation:
        # The limit of a point load does not exist: there the shared mesh says what the point is.
        graded = finger_mesh(Design(), settings=MeshSettings(corner_size=CORNER_SIZE))
        mesh = self.mesh if self.load.kind == "point" else graded
        return Evaluation.of(FemSolver().solve(Problem(mesh, load=self.load)), self.mesh)

    def __call__(self, seconds: float, field: DisplacementField) -> Judged:
        """Compare a field that was found in so many seconds."""
        rule, reference = body_quadrature(self.mesh), self._reference
        state = State.from_gradient(field.gradient(rule.location), self.problem)
        displacement = field_difference(
            field.displacement(rule.location), reference.displacement, rule.weights
        )
        stress = field_difference(state.von_mises, reference.von_mises, rule.weights)
        energy = float(np.sum(rule.weights * state.energy_density)) / reference.energy - 1
        return Judged(seconds, 100 * displacement.rel_l2, 100 * stress.rel_l2, 100 * energy)


class Watch:
    """Judges a training at a few times, evenly spaced in the logarithm; its clock stops meanwhile.

    Attributes:
        curve: What was judged so far; the last is the result.
    """

    def __init__(self, judge: Judge, budget: float, looks: int = 12) -> None:
        """Start the clock.

        Args:
            judge: The reference.
            budget: Seconds that the training has.
            looks: How often it is judged.
        """
        self.curve: list[Judged] = []
        self._judge, self._budget = judge, budget
        self._due = list(np.geomspace(budget / 100, budget, looks))
        judge.prepare()
        self._paused, self._started = 0.0, time.perf_counter()

    def seconds(self) -> float:
        """Time that the training has had so far."""
        return time.perf_counter() - self._started - self._paused

    def __call__(self, field: DisplacementField) -> bool:
        """Show the field as it is now, after a step; whether time is left for another."""
        seconds = self.seconds()
        if seconds >= self._due[0]:
            self.curve.append(self._judge(seconds, field))
            self._due = [due for due in self._due if due > seconds]
            self._paused = time.perf_counter() - self._started - seconds
        return bool(self._due)

    def follow(self, training: Iterable[DisplacementField]) -> list[Judged]:
        """Watch a training that yields its field after every step, to its end or until time is up."""
        field = None
        for field in training:
            if not self(field):
                return self.curve
        if field is not None:
            self.curve.append(self._judge(self.seconds(), field))
        return self.curve
