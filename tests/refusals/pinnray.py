"""Names of the refused expressions of the front door."""

from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd

import pinnray as pr
from pinnray.solvers.fem.linear import FemSolver

__all__ = ["FemSolver", "Path", "np"]

FRAME = pd.DataFrame({"x_mm": [20.0, 50.0], "y_mm": -1.0, "u_mm": [-1.0, -1.5], "v_mm": [-3.0, -8.5]})
SLENDER = pr.load_design("slender")


@cache
def solved() -> pr.Solution:
    """The default finger, pressed, on a coarse mesh."""
    return pr.solve("default", "fem", size=2.0)


@cache
def compared() -> pr.Comparison:
    """Its comparison with the simulated experiment."""
    return pr.compare("default", "fem", size=2.0)
