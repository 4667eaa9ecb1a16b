"""Names of solvers and measurements in pictures, tables and reports."""

from compare.evaluation.evaluation import Evaluation
from geometry.observations import Observations


def solver_label(evaluation: Evaluation) -> str:
    """The solver's name, marked where the solver did not converge."""
    return evaluation.solver if evaluation.converged else f"{evaluation.solver} (not converged)"


IN_SAMPLE = "† was given these markers: its errors there are training errors"
"""Meaning of the mark of `solver_at_markers`."""


def solver_at_markers(evaluation: Evaluation) -> str:
    """The solver's label where its errors at the markers stand, marked if it was given those markers."""
    return f"{solver_label(evaluation)}{' †' * evaluation.in_sample}"


def markers_label(observations: Observations) -> str:
    """`markers, measured` or `markers, simulated`."""
    return f"markers, {observations.label}"
