"""Names of the refused expressions of `studies`."""

# ruff: noqa: F401, because the expressions of approved.txt use the names

from pathlib import Path
from typing import Any

from pinnray.geometry.finger.design import Design
from pinnray.geometry.picture_frame import HAND_HELD
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Load, Material
from pinnray.studies.crossval.folds import load_cases_of
from pinnray.studies.crossval.study import CrossvalStudy
from pinnray.studies.emulator.inputs import Inputs
from pinnray.studies.emulator.store import emulator_of
from pinnray.studies.optimum.question import Question
from pinnray.studies.optimum.search import search_front
from pinnray.studies.sweep.job import StudyJob
from pinnray.studies.sweep.sampling import samples
from pinnray.studies.sweep.store import opened
from pinnray.studies.sweep.study import Study
from pinnray.studies.sweep.sweep import load_sweep
from tests.refusals.compare import markers, pressed
from tests.studies.emulator.sweeps import solved_sweep

RIBS = "[varied]\nrib_thickness = {from = 1, to = 2}\n"
FILES = {
    "ribs.toml": f"samples = 2\n{RIBS}",
    "fronts/journal.sqlite": b"no database at all, but longer than a header" * 9,
    "markers.csv": "x_mm,y_mm,u_mm,v_mm\n20,-1,0,-5\n",
}


def study(text: str = RIBS, head: str = "samples = 4\n") -> Study:
    """The study of a file with a table of what is varied below other lines."""
    path = Path("mine.toml")
    path.write_text(head + text, encoding="utf-8")
    return Study.load(path)


def varied(text: str, head: str = "samples = 4\n") -> Study:
    return study(f"[varied]\n{text}\n", head)


def crossval(**changes: Any) -> None:
    CrossvalStudy(design=Design(), solvers=[FemSolver()], out=Path("out"), **changes).check()


def task(asked: Study) -> object:
    return StudyJob(asked, Path(), Path("out")).task(0, samples(asked)[0])


def question(
    *,
    head: str = "mesh_size = 2.0\nruns = 40\n",
    objectives: str = 'wrap = "largest"\nforce = "least"',
    limits: str = "von_mises = {at_most = 2.0}",
    ranges: str = "rib_thickness = {from = 0.6, to = 2.5}",
) -> Question:
    """The question of a file with these tables."""
    path = Path("ask.toml")
    tables = {"objectives": objectives, "constraints": limits, "varied": ranges}
    path.write_text(head + "".join(f"[{name}]\n{text}\n" for name, text in tables.items()), encoding="utf-8")
    return Question.load(path)


def moving(
    text: str = "radius = {from = 4, to = 16}", load: str = "cylinder", solver: str = "fem-nonlinear"
) -> Study:
    """A study that keeps fields on a mesh that moves with the parameters."""
    head = f'solver = "{solver}"\nsamples = 4\nstrokes = 5\n[fixed]\nload = "{load}"\n'
    return varied(text, head)


def emulated(count: int) -> object:
    """The emulator of the first fingers of the kept sweep."""
    return emulator_of(solved_sweep(Path("kept"), count=count))
