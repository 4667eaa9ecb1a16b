"""Markers of the default finger and how they move when it is pressed."""

import numpy as np

from pinnray.geometry.finger.design import Design
from pinnray.runtime.arrays import FloatArray

MARKERS = {layout: Design(marker_layout=layout).markers for layout in ("front", "joints")}

# Displacements by `fem-nonlinear` with elements of 1.5 mm, pressed in by 12 mm at x = 35 and at x = 60 mm.
PRESSED = {
    "front": [
        [
            *((-0.39, -2.76), (-1.09, -6.45), (-1.94, -10.42), (-2.08, -12.02), (-2.28, -10.19)),
            *((-2.58, -7.87), (-2.95, -5.3), (-3.35, -2.65), (-3.74, -0.02)),
        ],
        [
            *((0.09, -1.19), (0.07, -3.07), (-0.21, -5.9), (-0.36, -8.13), (-0.43, -9.87)),
            *((-0.56, -11.76), (-0.53, -11.87), (-0.62, -10.51), (-0.74, -9.05)),
        ],
    ],
    "joints": [
        [
            *((-0.95, -5.49), (0.66, -4.6), (-2.01, -10.88), (1.17, -9.05), (-2.19, -10.88)),
            *((1.11, -9.09), (-2.66, -7.31), (-0.37, -6.07), (-3.52, -0.28)),
        ],
        [
            *((0.07, -2.46), (-0.74, -2.49), (-0.24, -6.33), (-0.35, -6.37), (-0.44, -9.52)),
            *((0.08, -9.31), (-0.56, -11.9), (0.44, -11.47), (-0.63, -9.21)),
        ],
    ],
}


def pressed(layout: str, generator: np.random.Generator) -> FloatArray:
    """A displacement between the two of `PRESSED`, shape (9, 2), mm."""
    share = generator.uniform()
    one, other = np.array(PRESSED[layout])
    return np.asarray(share * one + (1 - share) * other)
