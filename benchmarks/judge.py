"""Errors of displacement fields of the default finger, against graded finite elements."""

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
    """Errors of a field.

    Attributes:
        seconds: Time of its training, without the evaluation of errors.
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
        mesh: The shared mesh, where fields are compared.
    """

    load: Load
    mesh: TriangleMesh

    @classmethod
    def of(cls, load: Load | None = None) -> "Judge":
        """For a load; the default one if None."""
        return cls(load or Load(), finger_mesh(Design()))

    @cached_property
    def problem(self) -> Problem:
        """The problem."""
        return Problem(self.mesh, load=self.load)

    def prepare(self) -> None:
        """Solve for the reference."""
        self._reference  # noqa: B018 (cached)

    @cached_property
    def _reference(self) -> Evaluation:
        # A point load has no limit: its reference is on the shared mesh.
        graded = finger_mesh(Design(), settings=MeshSettings(corner_size=CORNER_SIZE))
        mesh = self.mesh if self.load.kind == "point" else graded
        return Evaluation.of(FemSolver().solve(Problem(mesh, load=self.load)), self.mesh)

    def __call__(self, seconds: float, field: DisplacementField) -> Judged:
        """Errors of a field after a time of training, s."""
        rule, reference = body_quadrature(self.mesh), self._reference
        state = State.from_gradient(field.gradient(rule.location), self.problem)
        displacement = field_difference(
            field.displacement(rule.location), reference.displacement, rule.weights
        )
        stress = field_difference(state.von_mises, reference.von_mises, rule.weights)
        energy = float(np.sum(rule.weights * state.energy_density)) / reference.energy - 1
        return Judged(seconds, 100 * displacement.rel_l2, 100 * stress.rel_l2, 100 * energy)


class Watch:
    """Evaluates a training at a few times, evenly spaced in the logarithm; its clock stops meanwhile.

    Attributes:
        curve: The errors so far; the last are the result.
    """

    def __init__(self, judge: Judge, budget: float, looks: int = 12) -> None:
        """Start the clock.

        Args:
            judge: The reference.
            budget: Time of the training, s.
            looks: Number of evaluations.
        """
        self.curve: list[Judged] = []
        self._judge, self._budget = judge, budget
        self._due = list(np.geomspace(budget / 100, budget, looks))
        judge.prepare()
        self._paused, self._started = 0.0, time.perf_counter()

    def seconds(self) -> float:
        """Time of the training so far, s."""
        return time.perf_counter() - self._started - self._paused

    def __call__(self, field: DisplacementField) -> bool:
        """Evaluate the field after a step if it is due; returns whether time is left for another step."""
        seconds = self.seconds()
        if seconds >= self._due[0]:
            self.curve.append(self._judge(seconds, field))
            self._due = [due for due in self._due if due > seconds]
            self._paused = time.perf_counter() - self._started - seconds
        return bool(self._due)

    def follow(self, training: Iterable[DisplacementField]) -> list[Judged]:
        """Evaluate a training that yields its field after every step, until it ends or time is up."""
        field = None
        for field in training:
            if not self(field):
                return self.curve
        if field is not None:
            self.curve.append(self._judge(self.seconds(), field))
        return self.curve
