"""What solvers and measurements are called in pictures, tables and reports."""

from compare.evaluation import Evaluation
from geometry.observations import Observations


def solver_label(evaluation: Evaluation) -> str:
    """The solver's name, marked where the solver did not converge."""
    return evaluation.solver if evaluation.converged else f"{evaluation.solver} (not converged)"


def markers_label(observations: Observations) -> str:
    """`markers, measured` or `markers, simulated`."""
    return f"markers, {observations.label}"


def significant(value: float, digits: int) -> str:
    """A number with so many significant digits, without an exponent below a million."""
    return f"{float(f'{value:.{digits}g}'):g}"
