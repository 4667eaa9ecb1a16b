"""The search on a law with a known front, its repetition, and the command on real fingers."""

import html
import re
import shlex
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from json import loads
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from pinnray.cli import main
from pinnray.comparison.evaluation.deformed_body import THROUGH_ITSELF
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.drawing.drawn_finger import finger_from
from pinnray.geometry.finger.presets import load_design
from pinnray.runtime.errors import UserError
from pinnray.solvers.finger_figures import QUANTITIES
from pinnray.solvers.problem import Problem
from pinnray.studies.optimum.designs import write_designs
from pinnray.studies.optimum.page import front_sentences, front_table, page_tables
from pinnray.studies.optimum.pictures import cylinder_at_end
from pinnray.studies.optimum.proposals import APART
from pinnray.studies.optimum.question import Limit, Question
from pinnray.studies.optimum.search import Optimum, search_front
from pinnray.studies.sweep.job import StudyJob, Task
from pinnray.studies.sweep.measurement import Ending, Measurement, measured
from pinnray.studies.sweep.sampling import places_of
from pinnray.studies.sweep.store import Journal
from pinnray.studies.sweep.study import physics_of

pytestmark = pytest.mark.usefixtures("few_elements_throughout")

VARIED = {
    "rib_count": {"from": 2, "to": 6},
    "rib_thickness": {"from": 1.0, "to": 2.5},
    "front_thickness": {"from": 1.0, "to": 2.5},
}
QUESTION = Question(
    name="known",
    fixed={"marker_diameter": 0.4},
    varied=VARIED,
    objectives={"wrap": "largest", "force": "least"},
    constraints={"von_mises": Limit(at_most=3.2)},
    runs=42,
)


def judged(task: Task) -> dict[str, float]:
    """A law whose front is known: of equal forces the finger with walls of 1.5 mm wraps most."""
    rib, front, count = (task.definition[name] for name in ("rib_thickness", "front_thickness", "rib_count"))
    force = rib**3 * (1 + 0.1 * count)
    wrap = 20 + 4 * np.log(force) - 8 * (front - 1.5) ** 2
    return dict.fromkeys(QUANTITIES, 1.0) | {"force": force, "wrap": wrap, "von_mises": rib + 0.1 * count}


def judge(
    tasks: Mapping[int, Task],
    journal: Journal,
    *_: object,
    state: Callable[[int], Ending] = lambda number: "done",
    said: Callable[[int], str] = lambda number: "",
) -> None:
    """Stands for the workers."""
    for number in sorted(tasks.keys() - journal.numbers()):
        values = judged(tasks[number]) if state(number) == "done" else {}
        journal.add(Measurement(number, state(number), said(number), 0.0, values))


@pytest.fixture(scope="module", autouse=True)
def quick() -> Iterator[None]:
    """Fewer rounds and a smaller population: the known front is easy."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("pinnray.studies.optimum.search.ROUNDS", 2)
        patch.setattr("pinnray.studies.optimum.proposals.POPULATION", 32)
        patch.setattr("pinnray.studies.optimum.proposals.GENERATIONS", 10)
        yield


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Optimum:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("pinnray.studies.optimum.search.finish", judge)
        return search_front(StudyJob(QUESTION, Path(), tmp_path_factory.mktemp("known") / "out", 1))


def test_the_known_front_is_found(found: Optimum) -> None:
    assert len(found.measurements) == QUESTION.runs
    assert len(found.front) >= 6
    values = [found.measurements[run].values for run in found.front]
    gap = np.array([20 + 4 * np.log(each["force"]) - each["wrap"] for each in values])
    assert (gap >= -1e-9).all()
    assert np.median(gap) < 0.1  # of 8 at the ends of the range; the 14 samples have a median above 1
    assert all(each["von_mises"] <= 3.2 for each in values)


def test_no_proposal_repeats_a_run(found: Optimum) -> None:
    """Fingers are compared as they are made: the search knows numbers of ribs that are not whole."""
    places = np.array([places_of(QUESTION, finger) for finger in found.samples])
    apart = np.linalg.norm(places[:, None] - places[len(places) // 3 :], axis=2)
    assert np.sort(apart, axis=0)[1].min() > APART


def test_one_objective_with_limits_has_the_best_fingers_in_their_order(tmp_path, capsys, monkeypatch):
    """Of this law the largest force is that of four ribs of 2.45 mm, at the limit of the stress."""
    monkeypatch.setattr("pinnray.studies.optimum.search.finish", judge)
    path = tmp_path / "grip.toml"
    path.write_text(
        'mesh_size = 4.0\nruns = 42\n[objectives]\nforce = "largest"\n[constraints]\n'
        "von_mises = {at_most = 2.85}\nwrap = {at_least = 20}\n[fixed]\nload = 'mean'\n[varied]\n"
        "rib_count = {from = 2, to = 6}\nrib_thickness = {from = 1.0, to = 2.5}\n"
        "front_thickness = {from = 1.0, to = 2.5}\n",
        encoding="utf-8",
    )
    out = tmp_path / "o u t"
    assert main(["optimise", str(path), "--out", str(out), "--processes", "1"]) == 0
    assert "Best fingers" in capsys.readouterr().out
    table = pd.read_csv(out / "front.csv")
    largest = 2.45**3 * 1.4
    assert 0.95 * largest < table["force_N"][0] <= largest
    assert table["force_N"].is_monotonic_decreasing
    assert (table["von_mises_MPa"] <= 2.85).all()
    assert (table["wrap_deg"] >= 20).all()
    page = html.unescape((out / "front.html").read_text(encoding="utf-8"))
    assert "largest force, with von_mises at most 2.85 MPa, wrap at least 20 deg" in page
    command = re.search(r"<code>pinnray (compare --from .*?)</code>", page)
    assert command
    assert main([*shlex.split(command[1]), "--out", str(tmp_path / "again"), "--quiet"]) == 0


@pytest.mark.slow
def test_a_search_that_was_stopped_goes_on_to_the_same_runs(found, tmp_path, monkeypatch):
    def interrupted(tasks: Mapping[int, Task], journal: Journal, *_: object) -> None:
        if len(tasks) > 30:
            raise KeyboardInterrupt
        judge(tasks, journal)

    job = StudyJob(QUESTION, Path(), tmp_path / "out", 1)
    monkeypatch.setattr("pinnray.studies.optimum.search.finish", interrupted)
    with pytest.raises(KeyboardInterrupt):
        search_front(job)
    monkeypatch.setattr("pinnray.studies.optimum.search.finish", judge)
    assert search_front(job).samples == found.samples


@pytest.mark.slow
def test_a_finger_that_goes_through_itself_is_not_on_the_front(found, tmp_path, monkeypatch):
    best = found.samples[found.front[0]]["rib_count"]

    def strict(tasks: Mapping[int, Task], *rest: Any) -> None:
        def said(number: int) -> str:
            crossed = tasks[number].definition["rib_count"] == best
            return f"{THROUGH_ITSELF}; converged" if crossed else ""

        judge(tasks, *rest, said=said)

    monkeypatch.setattr("pinnray.studies.optimum.search.finish", strict)
    other = search_front(StudyJob(QUESTION, Path(), tmp_path / "out", 1))
    crossed = [n for n, finger in enumerate(other.samples) if finger["rib_count"] == best]
    assert crossed
    assert not set(crossed) & set(other.front)
    assert f"{len(crossed)} runs do not count: the finger goes" in " ".join(front_sentences(other, tmp_path))


@pytest.mark.slow
def test_constraints_that_nothing_obeys_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pinnray.studies.optimum.search.finish", judge)
    asked = QUESTION.model_copy(update={"constraints": {"von_mises": Limit(at_most=0.1)}, "runs": 16})
    with pytest.raises(UserError, match=r"none of 16 runs obeys the constraints \(16 converged\); relax"):
        search_front(StudyJob(asked, Path(), tmp_path / "out", 1))


@pytest.mark.slow
def test_the_command_writes_the_front(tmp_path, capsys, monkeypatch):
    """The tutorial of the page for designers has the same on fingers that are solved."""
    monkeypatch.setattr("pinnray.studies.optimum.search.finish", judge)
    path = tmp_path / "small.toml"
    path.write_text(
        'mesh_size = 2.0\nruns = 40\n[objectives]\nwrap = "largest"\nforce = "least"\n'
        "[constraints]\nvon_mises = {at_most = 2.0}\n[fixed]\nmarker_diameter = 0.4\n"
        "contact_position = 35.0\n[varied]\nrib_count = {from = 2, to = 6}\n"
        "rib_thickness = {from = 1.0, to = 2.5}\nfront_thickness = {from = 1.0, to = 2.5}\n",
        encoding="utf-8",
    )
    out = tmp_path / "out"
    line = ["optimise", str(path), "--out", str(out), "--processes", "1", "--pictures", "svg"]
    assert main(line) == 0
    assert "Fingers on the front" in capsys.readouterr().out
    assert (out / "front.html").read_text(encoding="utf-8").count("<img alt=") == 2
    assert {path.name for path in out.glob("*.svg")} == {"front.svg", "fingers.svg"}
    designs = sorted((out / "front").glob("*.toml"))
    assert designs
    for design in map(load_design, designs):
        assert design.rib_thickness + 0.1 * design.rib_count <= 2.0
    rows = (out / "front.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) == 1 + len(designs)
    problems = sorted((out / "problems").glob("*.toml"))
    assert [each.name for each in problems] == [each.name for each in designs]


def test_the_problem_of_a_finger_gives_the_number_of_the_front(tmp_path, capsys, without_pictures):
    """The load was lost: the design alone had another force by a factor of two."""
    physics = {"load": "cylinder", "radius": 8.0, "stroke": 3.0, "young": 3.0, "law": "neo-hookean"}
    solver = {"solver": "fem-nonlinear", "settings": {"degree": 1}, "mesh_size": 3.0}
    asked = QUESTION.model_copy(update={**solver, "fixed": {"contact_position": 35.0, **physics}})
    job = StudyJob(asked, Path(), tmp_path / "search")
    task = job.task(7, {"rib_count": 3, "rib_thickness": 1.9, "front_thickness": 0.9})
    found = measured(task)
    assert found.state == "done"
    write_designs(job, task, tmp_path / "search" / "front" / "01.toml")
    problem = tmp_path / "search" / "problems" / "01.toml"
    assert main(["compare", "--from", str(problem), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    metrics = loads((tmp_path / "out" / "metrics.json").read_text(encoding="utf-8"))
    values = metrics["solvers"]["fem-nonlinear"]["figures"]["values"]
    for name, unit in (("force", "N"), ("wrap", "deg")):
        assert values[f"{name}_{unit}"] == pytest.approx(found.values[name], rel=1e-9)


def test_thin_walls_are_not_refused_for_their_markers(tmp_path: Path) -> None:
    asked = QUESTION.model_copy(update={"fixed": {"marker_diameter": 1.6}, "mesh_size": 3.0})
    job = StudyJob(asked, Path(), tmp_path / "out")
    task = job.task(0, {"rib_count": 3, "rib_thickness": 0.8, "front_thickness": 0.8})
    assert measured(task).state == "done"
    path = write_designs(job, task, tmp_path / "front" / "01.toml")
    assert 0.1 < load_design(path).marker_diameter <= 0.7  # which fits, and can be printed


def test_a_search_with_few_converged_runs_takes_further_samples(tmp_path, monkeypatch):
    hard = partial(judge, state=lambda number: "not converged" if number % 3 else "done")
    monkeypatch.setattr("pinnray.studies.optimum.search.finish", hard)
    asked = QUESTION.model_copy(update={"runs": 20, "samples": 12})
    found = search_front(StudyJob(asked, Path(), tmp_path / "out", 1))
    assert len(found.measurements) == 20


def test_the_tables_of_the_page_are_narrow_and_complete(found: Optimum) -> None:
    tables, whole = page_tables(found), front_table(found)
    headings = [heading for table in tables for heading in table.headings]
    assert list(whole["run"]) == found.front
    assert list(whole["force_N"]) == [found.measurements[run].values["force"] for run in found.front]
    plain = {heading.replace("\n", "_").replace("mm/N", "mm_per_N") for heading in headings}
    assert plain == {*whole.columns}
    letters = [sum(max(map(len, heading.split("\n"))) + 2 for heading in table.headings) for table in tables]
    assert max(letters) < 130  # of the 140 that 62 rem hold


def test_the_cylinder_is_drawn_where_it_ends(tmp_path: Path) -> None:
    fixed = {"load": "cylinder", "radius": 8.0, "stroke": 3.0, "contact_position": 35.0}
    asked = QUESTION.model_copy(update={"solver": "fem-nonlinear", "mesh_size": 3.0, "fixed": fixed})
    task = StudyJob(asked, Path(), tmp_path).task(
        0, {"rib_count": 3, "rib_thickness": 2, "front_thickness": 2}
    )
    mesh = finger_mesh(finger_from(task.definition), settings=task.mesh)
    circle = cylinder_at_end(Problem(mesh, *physics_of(task.physics)))
    assert circle is not None
    assert (*circle.center, circle.radius) == pytest.approx((35.0, 5.0, 8.0))
    assert cylinder_at_end(Problem(mesh)) is None
