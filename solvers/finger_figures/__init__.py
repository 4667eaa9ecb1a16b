"""Figures of a finger under its load, in its designer's units: force, tip, wrap, stress, compliance, mass."""

from pinnray.solvers.finger_figures.figures import QUANTITIES as QUANTITIES
from pinnray.solvers.finger_figures.figures import FingerFigures as FingerFigures
from pinnray.solvers.finger_figures.figures import Quantity as Quantity
from pinnray.solvers.finger_figures.figures import break_answer as break_answer
from pinnray.solvers.finger_figures.figures import figures_at_rest as figures_at_rest
from pinnray.solvers.finger_figures.figures import figures_of as figures_of
from pinnray.solvers.finger_figures.figures import heading as heading
