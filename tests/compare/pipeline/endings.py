"""Solvers that end in the way of their name, and a program that runs them, without DOLFINx."""

import os
import signal
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from pinnray.comparison.pipeline import solving
from pinnray.comparison.pipeline.job import Job
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.observations import Observations
from pinnray.runtime.errors import UserError
from pinnray.runtime.exits import interruptible
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import Progress, UnsupportedProblemError, silent

DESIGN = Design()
MESH = finger_mesh(DESIGN, settings=MeshSettings(size=1.5))
PROBLEM = Problem(MESH, finger=DESIGN)
STILL = np.zeros_like(MESH.markers)
MARKERS = Observations(MESH.markers, STILL, STILL, np.full(len(STILL), True), "no test looks", True, 1.0)


@dataclass(frozen=True)
class Ending:
    """A solver of finite strain, unless it has another law, that ends in the way of its name."""

    name: str
    laws: tuple[str, ...] = ("neo-hookean",)
    loads: ClassVar[tuple[str, ...]] = ("mean", "point")

    def settings(self) -> dict[str, object]:
        return {}

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        if self.name == "killed":
            os.kill(os.getpid(), signal.SIGKILL)
        if self.name == "faulty":
            raise ZeroDivisionError("by nothing")
        if self.name == "unsupporting":
            raise UnsupportedProblemError("unsupporting: no markers here")
        if self.name == "refusing":
            raise UserError("refusing: the weight is negative")
        progress(0.5, str(os.getpid()))
        while True:
            time.sleep(0.02)
            if self.name == "reporting":
                progress(0.5, "")


class Said:
    """Stages that print the numbers of processes."""

    def stage(self, name: str) -> "Said":
        return self

    def told(self, name: str, fraction: float = 1.0, note: str = "") -> None:
        if note.isdigit():
            print(note, flush=True)

    def __enter__(self) -> Progress:
        return lambda fraction, note: self.told("", fraction, note)

    def __exit__(self, *_: object) -> None:
        pass


def main() -> None:
    """The program; its classes must not be of `__main__`, which other processes do not know."""
    solving.LARGE = 0
    solvers = Ending("reporting", laws=("linear",)), Ending(sys.argv[2])
    with interruptible(), solving.second_process() as pool:
        solving.solve_all(Job(DESIGN, solvers), solvers, PROBLEM, MARKERS, Path(sys.argv[1]), Said(), pool)
