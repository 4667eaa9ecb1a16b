"""Steps along derivatives, judged by the solver."""

from pathlib import Path

import numpy as np
import pytest

from pinnray.studies.optimum.gradient_step import TRUST, stepped
from pinnray.studies.optimum.page import steps_sentence
from pinnray.studies.optimum.question import Limit, Question
from pinnray.studies.optimum.search import search_front
from pinnray.studies.sweep.job import StudyJob
from pinnray.studies.sweep.measurement import measured

pytestmark = pytest.mark.usefixtures("few_elements")

VARIED = {
    "rib_thickness": {"from": 1.0, "to": 2.5},
    "front_thickness": {"from": 1.0, "to": 2.5},
    "rib_angle": {"from": 0, "to": 30},
    "rib_count": {"values": [3, 4]},
}
FINGER = {"rib_thickness": 1.8, "front_thickness": 1.6, "rib_angle": 12.0, "rib_count": 4}


def question(**changes: object) -> Question:
    return Question(
        **{
            "name": "step",
            "solver": "fem",
            "mesh_size": 4.0,
            "samples": 12,
            "varied": VARIED,
            "objectives": {"wrap": "largest", "force": "largest"},
            **changes,
        }
    )


def job(asked: Question) -> StudyJob[Question]:
    return StudyJob(asked, Path(), Path("out"))


@pytest.mark.slow
def test_a_step_is_better_in_every_objective_by_what_the_derivatives_say():
    asked = job(question(mesh_size=1.0, objectives={"von_mises": "least", "force": "largest"}))
    before = measured(asked.task(0, FINGER))
    moved = stepped(asked, FINGER, before)
    assert moved is not None
    assert moved["rib_count"] == 4
    after = measured(asked.task(1, moved))
    ratios = [after.values[name] / before.values[name] for name in ("von_mises", "force")]
    assert ratios == pytest.approx([1 - 0.0208, 1 + 0.0208], abs=0.004)  # as promised but for other elements
    for name in ("rib_thickness", "front_thickness", "rib_angle"):
        low, high = VARIED[name]["from"], VARIED[name]["to"]
        assert abs(moved[name] - FINGER[name]) <= TRUST * (high - low) * (1 + 1e-9)


@pytest.mark.slow
def test_a_step_obeys_a_constraint_that_is_met_exactly():
    objectives = {"force": "largest", "compliance_across": "least"}
    free = job(question(objectives=objectives))
    before = measured(free.task(0, FINGER))
    largest = before.values["von_mises"]
    held = job(question(objectives=objectives, constraints={"von_mises": Limit(at_most=largest)}))
    steps = {name: stepped(each, FINGER, before) for name, each in (("free", free), ("held", held))}
    assert steps["free"] is not None
    assert steps["held"] is not None
    stress = {name: measured(free.task(1, step)).values["von_mises"] for name, step in steps.items() if step}
    assert stress["held"] <= 1.005 * largest  # to first order, and on other elements
    assert stress["free"] > 1.01 * largest


def test_no_step_leads_on_from_a_corner_of_the_ranges():
    corner = {"rib_thickness": 2.5, "front_thickness": 2.5}
    varied = {name: VARIED[name] for name in corner}
    asked = job(question(varied=varied, objectives={"force": "largest", "compliance_across": "least"}))
    assert stepped(asked, corner, measured(asked.task(0, corner))) is None


@pytest.mark.release
def test_a_search_ends_with_the_steps_and_says_what_they_gained(tmp_path, monkeypatch, in_line):
    asked = question(runs=20, steps=2)
    monkeypatch.setattr("pinnray.studies.optimum.proposals.POPULATION", 16)
    monkeypatch.setattr("pinnray.studies.optimum.proposals.GENERATIONS", 4)
    found = search_front(StudyJob(asked, Path(), tmp_path / "out", 2))
    assert 20 < len(found.measurements) <= 22
    assert (np.diff(found.volumes[19:]) >= 0).all()
    (said,) = steps_sentence(found)
    assert "step along exact derivatives" in said
    again = search_front(StudyJob(asked, Path(), tmp_path / "out", 2))
    assert again.fingers == found.fingers  # nothing is left to do
