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
    assert "±" in answer.sentences[0]


def test_a_network_that_did_not_converge_is_not_trusted(compared, fem, evaluate):
    found = asked(compared(fem, evaluate("pinn-std", converged=False, message="it moves on")))
    assert found[TRUST].verdict == "No, not with pinn-std (not converged)."
    assert found[CONVERGED].verdict == "1 of 2 solvers: pinn-std (not converged)."
    assert "pinn-std (not converged): it moves on." in found[CONVERGED].sentences


def test_the_error_of_the_model_is_not_laid_on_the_network(compared, fem, evaluate):
    network, blame = evaluate("pinn-std", 1.001), "That is the error of the model and its load"
    far = asked(compared(fem, network, truth=evaluate("fem-nonlinear", 1.5)))[TRUST]
    assert blame in " ".join(far.sentences)
    near = asked(compared(fem, evaluate("pinn-std", 1.4), truth=evaluate("fem-nonlinear", 1.5)))[TRUST]
    assert blame not in " ".join(near.sentences)


def test_markers_help_by_what_was_held_out_never_by_what_was_given(compared, fem, given):
    """The reference is 0.7 mm off; the other one meets its markers, and counts with its 0.1 mm."""
    answer = asked(compared(fem, given))[MARKERS]
    assert answer.verdict == "Nearer than fem: at held-out simulated markers fem-asm."
    assert [row[:2] for row in answer.table.rows] == [["fem", "0.700"], ["fem-asm", "0.100"]]
    worse = replace(given, left_out=given.left_out + np.array([5.0, 0.0]))
    assert asked(compared(fem, worse))[MARKERS].verdict.endswith(" none.")


def test_stress_and_force_are_answered_where_they_are_known(compared, fem, given, evaluate):
    """The truth is half as much again: 1.02 of the reference is nearer in everything but its force."""
    stronger = replace(given, reaction=10 * fem.reaction)
    answer = asked(compared(fem, stronger, truth=evaluate("fem-nonlinear", 1.5)))[MARKERS]
    assert answer.verdict.endswith("in displacement fem-asm, in von Mises stress fem-asm, in force none.")
    assert "simulated body" in answer.verdict


def test_the_first_answer_is_by_the_solver_nearest_to_the_truth_and_says_how_far_its_force_is(
    compared, fem, evaluate
):
    """`fem` is 1 / 1.5 of the truth; the other one is as far in displacement as its force, and no worse."""
    figures = FingerFigures(force=4.0, tip_u=0.3, tip_v=0.4, principal_strain=0.05)
    plain, near = replace(fem, figures=figures), replace(evaluate("fem-id", 1.45), figures=figures)
    truth = evaluate("fem-nonlinear", 1.5)
    said = asked(compared(plain, near, truth=truth))["What does the finger do?"].verdict
    assert said.replace("\N{NO-BREAK SPACE}", " ").startswith(
        "By fem-id the force is 4.00 N (−3.3 % off the simulated finger’s), its tip moves by 0.500 mm"
    )
    said = asked(compared(plain, truth=truth))["What does the finger do?"].verdict
    assert "By fem the force is 4.00 N (−33 % off" in said.replace("\N{NO-BREAK SPACE}", " ")
    off = asked(compared(plain, replace(near, converged=False), truth=truth))
    assert off["What does the finger do?"].verdict.startswith("By fem ")
