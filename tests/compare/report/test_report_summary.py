"""The answers that a report opens with, from metrics whose answers are known."""

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.report.output_files import metrics
from pinnray.comparison.report.summary import RunAnswer, answers
from pinnray.comparison.report.text import truth_sentences
from pinnray.geometry.observations import Observations
from pinnray.solvers.solution import Estimated, IdentifiedForce

TRUST, MARKERS = "May the network be trusted here?", "Did the markers help?"
CONVERGED = "What is not converged?"


def asked(comparison: Results, **said: dict[str, str]) -> dict[str, RunAnswer]:
    return {answer.question: answer for answer in answers(metrics(comparison), **said)}


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


@pytest.mark.parametrize(("low", "word"), [(0.4, "inside"), (0.6, "outside")])
def test_a_found_force_has_its_interval(compared, fem, given, evaluate, low, word):
    found = replace(given, identified=IdentifiedForce(Estimated(0.5, low, 0.8), Estimated(36.0, 35.0, 37.5)))
    sentences = asked(compared(fem, found, truth=evaluate("fem-nonlinear", 1.0)))[MARKERS].sentences
    said = sentences[-1].replace("\N{NO-BREAK SPACE}", " ")
    assert f"0.500 N/mm (95 % interval {low:.3f} to 0.800), 10.0 N over the depth of 20 mm" in said
    assert "at x = 36.0 mm (35.0 to 37.5 mm)" in said
    assert f"that of the simulated finger is 0.500, {word} it." in sentences[-1]


def test_what_raised_an_exception_or_was_left_out_is_named(compared, fem):
    answer = asked(compared(fem), failed={"mine": "it broke"}, unsupported={"gp": "no markers"})[CONVERGED]
    assert answer.verdict == "1 of 2 solvers: mine."
    assert {"mine failed: it broke.", "gp was left out: no markers."} <= set(answer.sentences)


@pytest.mark.parametrize(("converged", "twin"), [(True, True), (False, True), (True, False)])
def test_a_network_stands_beside_its_twin_whether_both_converged_or_not(
    compared, fem, given, evaluate, converged, twin
):
    network = evaluate("pinn-asm", 1.02, converged=converged)
    network = replace(network, in_sample=True, left_out=given.left_out, twin="fem-asm")
    sentences = asked(compared(fem, replace(given, converged=twin), network))[TRUST].sentences
    name = "fem-asm" if twin else "fem-asm (not converged)"
    assert any(f"{name}, its twin by finite elements, 0.100 mm" in said for said in sentences)


def test_what_the_markers_change_is_told_of_displacement_stress_and_force(fem, pinn, compared):
    """The truth is the reference times 1.1; the stress of the solver that was given markers is tripled."""
    given = replace(pinn, in_sample=True, von_mises=3 * pinn.von_mises)
    plain, changed, answer = truth_sentences(compared(fem, given, truth=pinn))
    assert re.findall(r"[\d.]+(?=\xa0%)", plain) == ["9.09"] * 3
    told = [("0", "nearer"), ("200", "farther"), ("0", "nearer")]
    assert re.findall(r"([\d.]+)\xa0% \((\w+)\)", changed) == told
    assert re.findall(r": ([^.]+)\.", answer) == ["pinn-std", "none", "pinn-std"]


def test_a_solver_without_a_force_is_neither_nearer_nor_farther_in_it(compared, fem, given, pinn, evaluate):
    """In words and in the table; one with a force is still judged."""
    without = replace(given, reaction=np.full(2, np.nan))
    truth = evaluate("fem-nonlinear", 1.5)
    alone = asked(compared(fem, without, truth=truth))[MARKERS]
    assert alone.verdict.endswith(
        "over the simulated body in displacement fem-asm, in von Mises stress fem-asm."
    )
    assert alone.table.rows[1][-1] == "–"
    both = asked(compared(fem, without, replace(pinn, in_sample=True), truth=truth))[MARKERS]
    assert both.verdict.endswith("in force only pinn-std.")
    *_, changed, answer = truth_sentences(compared(fem, without, truth=truth))
    assert changed.endswith("(nearer), force –.")
    assert answer.endswith("Nearer in the indenter's force: unknown.")


def test_there_is_nothing_to_say_without_a_truth_or_a_solver_with_markers(fem, pinn, compared):
    given = replace(pinn, in_sample=True)
    assert truth_sentences(compared(fem, given)) == []
    assert truth_sentences(compared(fem, pinn, truth=pinn)) == []
    assert truth_sentences(compared(given, fem, truth=pinn)) == []
