"""Convergence of a result, by its solver's own criterion and by its certificate."""

import warnings
from collections.abc import Sequence
from dataclasses import replace

from compare.evaluation.certificate import Certificate
from compare.evaluation.evaluation import Evaluation
from solvers.problem import Problem
from solvers.registry import MissingLibraryError, make_solver

CERTIFIED_LAW = "linear"
"""Only there does the least energy settle the question: it is quadratic."""


NOT_FINITE = "its displacement or stress is not finite everywhere"
"""What is said of a result with NaN or infinity in a field."""


def with_certificates(evaluations: Sequence[Evaluation], problem: Problem) -> list[Evaluation]:
    """The evaluations, those of the linear law with a certificate and the verdict that follows from it.

    A solver that was given observations pays energy for them, and a body in three dimensions has another
    energy, so that the least energy of the plane does not judge them; nor does it judge a found contact.
    Without DOLFINx there are no certificates, and a warning says so.

    Args:
        evaluations: Sampled on the problem's mesh.
        problem: What was solved; each evaluation knows its own law.
    """
    if problem.load.kind == "cylinder" or not any(map(_certifiable, evaluations)):
        return list(evaluations)
    try:
        make_solver("fem")
    except MissingLibraryError as error:
        warnings.warn(f"no result is certified: {error}", stacklevel=2)
        return list(evaluations)
    from compare.evaluation.certification import Certifier

    material = problem.material.model_copy(update={"law": CERTIFIED_LAW})
    certifier = Certifier(replace(problem, material=material))
    return [
        with_certificate(evaluation, certifier.certificate(evaluation) if evaluation.finite else None)
        if _certifiable(evaluation)
        else evaluation
        for evaluation in evaluations
    ]


def _certifiable(evaluation: Evaluation) -> bool:
    return evaluation.law == CERTIFIED_LAW and not evaluation.in_sample and not evaluation.solid


def with_certificate(evaluation: Evaluation, certificate: Certificate | None) -> Evaluation:
    """The evaluation with its certificate; not converged if that finds a fault, whatever the solver says.

    A result that is not finite has no certificate, which is a fault of its own.
    """
    faults = [NOT_FINITE] if certificate is None else certificate.faults
    return replace(
        evaluation,
        converged=evaluation.converged and not faults,
        message="; ".join([evaluation.message.rstrip(". "), *faults]),
        certificate=certificate,
    )
