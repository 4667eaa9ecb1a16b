"""The search on a law with a known front, its repetition, and the command on real fingers."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import pytest

from compare.evaluation.deformed_body import THROUGH_ITSELF
from compare.runtime.stages import Stages
from geometry.errors import UserError
from geometry.finger.presets import load_design
from pinnray.cli import main
from solvers.finger_figures import QUANTITIES
from studies.optimum.page import front_grid, front_sentences, spread
from studies.optimum.question import Limit, Question
from studies.optimum.search import Optimum, search_front
from studies.sweep.job import StudyJob, Task
from studies.sweep.measurement import Measurement
from studies.sweep.store import Journal
from studies.sweep.study import Range

VARIED = {
    "rib_count": {"from": 2, "to": 6},
    "rib_thickness": {"from": 1.0, "to": 2.5},
    "front_thickness": {"from": 1.0, "to": 2.5},
}
QUESTION = Question(
    name="known",
    samples=14,
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


def judge(tasks: Mapping[int, Task], journal: Journal, *_: object) -> None:
    """Stands for the workers."""
    for number in sorted(tasks.keys() - journal.numbers()):
        journal.add(Measurement(number, "done", "", 0.0, judged(tasks[number])))


@pytest.fixture(scope="module", autouse=True)
def quick() -> Iterator[None]:
    """Fewer rounds and a smaller population: the known front is easy."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("studies.optimum.search.ROUNDS", 2)
        patch.setattr("studies.optimum.proposals.POPULATION", 32)
        patch.setattr("studies.optimum.proposals.GENERATIONS", 10)
        yield


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Optimum:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("studies.optimum.search.finish", judge)
        return search_front(StudyJob(QUESTION, Path(), tmp_path_factory.mktemp("known") / "out", 1))


def test_the_known_front_is_found(found: Optimum) -> None:
    assert len(found.measurements) == QUESTION.runs
    assert len(found.front) >= 6
    values = [found.measurements[run].values for run in found.front]
    gap = np.array([20 + 4 * np.log(each["force"]) - each["wrap"] for each in values])
    assert (gap >= -1e-9).all()
    assert np.median(gap) < 0.1  # of 8 at the ends of the range; the 14 samples have a median above 1
    assert all(each["von_mises"] <= 3.2 for each in values)


def test_the_hypervolume_grows_past_that_of_the_samples(found: Optimum) -> None:
    assert (np.diff(found.volumes) >= -1e-12).all()
    assert found.volumes[-1] > 1.05 * found.volumes[13]


def test_the_same_seed_has_the_same_runs_to_the_bit(found, tmp_path, monkeypatch):
    monkeypatch.setattr("studies.optimum.search.finish", judge)
    again = search_front(StudyJob(QUESTION, Path(), tmp_path / "out", 1))
    assert again.fingers == found.fingers
    assert again.measurements == found.measurements


def test_a_search_that_was_stopped_goes_on_to_the_same_runs(found, tmp_path, monkeypatch):
    def interrupted(tasks: Mapping[int, Task], journal: Journal, *_: object) -> None:
        if len(tasks) > 30:
            raise KeyboardInterrupt
        judge(tasks, journal)

    job = StudyJob(QUESTION, Path(), tmp_path / "out", 1)
    monkeypatch.setattr("studies.optimum.search.finish", interrupted)
    with pytest.raises(KeyboardInterrupt):
        search_front(job)
    monkeypatch.setattr("studies.optimum.search.finish", judge)
    assert search_front(job).fingers == found.fingers


def test_the_shown_fingers_span_the_front(found: Optimum) -> None:
    shown = spread(found)
    assert len(shown) <= 6
    assert {shown[0], shown[-1]} == {found.front[0], found.front[-1]}


def test_the_table_has_a_row_for_each_finger_on_the_front(found: Optimum) -> None:
    grid = front_grid(found)
    assert grid.headings[:5] == ("finger", "run", "wrap_deg", "force_N", "von_mises_MPa")
    assert [int(row[1]) for row in grid.rows] == found.front
    assert len(set(map(len, grid.rows))) == 1


def test_a_finger_that_goes_through_itself_is_not_on_the_front(found, tmp_path, monkeypatch):
    best = found.fingers[found.front[0]]["rib_count"]

    def strict(tasks: Mapping[int, Task], journal: Journal, *_: object) -> None:
        for number in sorted(tasks.keys() - journal.numbers()):
            crossed = tasks[number].definition["rib_count"] == best
            said = f"{THROUGH_ITSELF}; converged" if crossed else ""
            journal.add(Measurement(number, "done", said, 0.0, judged(tasks[number])))

    monkeypatch.setattr("studies.optimum.search.finish", strict)
    other = search_front(StudyJob(QUESTION, Path(), tmp_path / "out", 1))
    crossed = [n for n, finger in enumerate(other.fingers) if finger["rib_count"] == best]
    assert crossed
    assert not set(crossed) & set(other.front)
    assert f"{len(crossed)} runs do not count: the finger goes" in " ".join(front_sentences(other))


def test_constraints_that_nothing_obeys_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("studies.optimum.search.finish", judge)
    asked = QUESTION.model_copy(update={"constraints": {"von_mises": Limit(at_most=0.1)}})
    with pytest.raises(UserError, match=r"none of 42 runs obeys the constraints \(42 converged\); relax"):
        search_front(StudyJob(asked, Path(), tmp_path / "out", 1))


def test_ranges_in_which_no_finger_can_be_made_are_told(tmp_path: Path) -> None:
    thick = {"rib_thickness": Range(**{"from": 25.0, "to": 30.0})}
    asked = QUESTION.model_copy(update={"varied": thick})
    with pytest.raises(UserError, match=r"only 0 of 896 fingers in these ranges can be made \(ribs overlap"):
        search_front(StudyJob(asked, Path(), tmp_path / "out", 1), Stages(quiet=True))


def test_the_command_writes_the_front(tmp_path, capsys, monkeypatch):
    """The tutorial of the page for designers has the same on fingers that are solved."""
    monkeypatch.setattr("studies.optimum.search.finish", judge)
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
    assert (out / "front.html").read_text(encoding="utf-8").count("<img alt=") == 3
    assert {path.name for path in out.glob("*.svg")} == {"front.svg", "fingers.svg", "growth.svg"}
    designs = sorted((out / "front").glob("*.toml"))
    assert designs
    for design in map(load_design, designs):
        assert design.rib_thickness + 0.1 * design.rib_count <= 2.0
    rows = (out / "front.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) == 1 + len(designs)
