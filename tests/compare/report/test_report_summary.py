"""The answers that a report opens with, from metrics whose answers are known."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.report.summary import RunAnswer, answers
from pinnray.geometry.observations import Observations
from pinnray.solvers.finger_figures import FingerFigures
from pinnray.solvers.solution import Estimated, IdentifiedForce

TRUST, MARKERS = "May the network be trusted here?", "Did the markers help?"
CONVERGED = "What is not converged?"


def asked(comparison: Results) -> dict[str, RunAnswer]:
    return {answer.question: answer for answer in answers(comparison.scores)}


@pytest.fixture
def given(evaluate: Callable[..., Evaluation], fem: Evaluation, observations: Observations) -> Evaluation:
    """A solver that meets its markers exactly and is 0.1 mm off in u at each that is held out."""
    made = replace(evaluate("fem-asm", 1.02), in_sample=True)
    return replace(
        made,
        marker_displacement=observations.displacements,
        left_out=observations.displacements + np.array([0.1, 0.0]),
    )


@pytest.mark.parametrize(("scale", "verdict"), [(1.005, "Yes, as a solver:"), (1.1, "As a solver to 10 %:")])
def test_a_network_is_judged_by_the_error_of_its_reference(compared, estimated, evaluate, scale, verdict):
    answer = asked(compared(estimated, evaluate("pinn-std", scale)))[TRUST]
    assert answer.verdict.replace("\N{NO-BREAK SPACE}", " ").startswith(verdict)
    assert [row[0] for row in answer.table.rows] == ["fem", "pinn-std"]
    assert "±" in answer.table.rows[0][1]


def test_a_network_that_did_not_converge_is_not_trusted(compared, fem, evaluate):
    found = asked(compared(fem, evaluate("pinn-std", converged=False, message="it moves on")))
    assert found[TRUST].verdict == "No, not with pinn-std (not converged)."
    assert found[CONVERGED].verdict == "1 of 2 solvers: pinn-std (not converged)."
    assert "pinn-std (not converged): it moves on." in found[CONVERGED].sentences


def test_the_error_of_the_model_is_not_laid_on_the_network(compared, fem, evaluate):
    network, blame = evaluate("pinn-std", 1.001), "that is the error of the model and its load"
    far = asked(compared(fem, network, truth=evaluate("fem-nonlinear", 1.5)))[TRUST]
    assert blame in " ".join(far.sentences)
    near = asked(compared(fem, evaluate("pinn-std", 1.4), truth=evaluate("fem-nonlinear", 1.5)))[TRUST]
    assert blame not in " ".join(near.sentences)


def test_markers_help_by_what_was_held_out_never_by_what_was_given(compared, fem, given):
    """The reference is 0.7 mm off; the other one meets its markers, and counts with its 0.1 mm."""
    answer = asked(compared(fem, given))[MARKERS]
    assert answer.verdict == "Nearer than fem: at held-out markers fem-asm."
    assert [row[:2] for row in answer.table.rows] == [["fem", "0.700"], ["fem-asm", "0.100"]]
    worse = replace(given, left_out=given.left_out + np.array([5.0, 0.0]))
    assert asked(compared(fem, worse))[MARKERS].verdict == "Nearer than fem: at held-out markers none."


def test_stress_and_force_are_answered_where_they_are_known(compared, fem, given, evaluate):
    """The truth is half as much again: 1.02 of the reference is nearer in everything but its force."""
    stronger = replace(given, reaction=10 * fem.reaction)
    answer = asked(compared(fem, stronger, truth=evaluate("fem-nonlinear", 1.5)))[MARKERS]
    measures = "at held-out markers {0}; in displacement {0}; in von Mises stress {0}; in force {1}."
    assert answer.verdict == f"Nearer than fem: {measures.format('fem-asm', 'none')}"
    other = replace(given, solver="fem-x", reaction=1.4 * fem.reaction)
    answer = asked(compared(fem, stronger, other, truth=evaluate("fem-nonlinear", 1.5)))[MARKERS]
    assert answer.verdict == f"Nearer than fem: {measures.format('both', 'fem-x')}"


def test_the_first_answer_is_by_the_solver_nearest_to_the_truth_of_those_that_found_the_load(
    compared, fem, evaluate
):
    """`fem` is 1 / 1.5 of the truth; one that was given the markers carries their forces too."""
    figures = FingerFigures(force=4.0, tip_u=0.3, tip_v=0.4, principal_strain=0.05, mass=12.3)
    force = IdentifiedForce(Estimated(0.5, 0.4, 0.8), Estimated(0.0, -0.1, 0.1), None)
    plain, near = replace(fem, figures=figures), replace(evaluate("fem-id", 1.45), figures=figures)
    fitted, found = replace(near, in_sample=True), replace(near, in_sample=True, identified=force)
    truth, name = evaluate("fem-nonlinear", 1.5), "What does the finger do?"
    for others, best in (((near,), "fem-id"), ((fitted,), "fem"), ((found,), "fem-id"), ((), "fem")):
        said = asked(compared(plain, *others, truth=truth))[name].verdict.replace("\N{NO-BREAK SPACE}", " ")
        assert said.startswith(f"By {best} the force is 4.00 N")
        assert "the tip moves by 0.500 mm" in said
    off = asked(compared(plain, replace(near, converged=False), truth=truth))
    assert off[name].verdict.startswith("By fem ")


def test_a_figure_that_is_zero_or_unknown_has_no_row(compared, fem):
    figures = FingerFigures(force=4.0, tip_u=0.0, mass=12.3)
    answer = asked(compared(replace(fem, figures=figures)))["What does the finger do?"]
    assert [row[0] for row in answer.table.rows] == ["force, N"]
    assert answer.sentences == ["At rest: mass 12.3 g."]
