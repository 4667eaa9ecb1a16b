"""Places that the authors computed with COMSOL and print in their code.

Source: srl-ethz/diffPD_sim2real, python/realbeam_experiments/clamped_beam_Case_A-1.py, clamped_beam_Case_B.py
and their other cases, MIT licence.
"""

import numpy as np

MODULUS = 0.263824
"""Young's modulus that the authors found from the case `gravity`, MPa."""

PLACES = {
    "gravity": np.array(
        [(1.0147, 15.001, 23.226), (0.51624, -0.0009737, 17.248), (-0.96361, 30.000, -0.69132)]
    ),
    "load52": np.array([(2.0836, 15.015, 12.669), (0.46708, -0.10591, 7.1591), (-3.4292, 30.016, -10.282)]),
    "load101": np.array(
        [(1.9954, 15.036, 2.4577), (-0.59825, -0.19764, -2.3518), (-6.7193, 30.034, -19.022)]
    ),
}
"""Of the points below the three markers, case by case, shape (3, 3), mm."""
