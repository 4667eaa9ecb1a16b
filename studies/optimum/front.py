"""Points that no other point beats, and the hypervolume that they dominate."""

import moocore
import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray

MARGIN = 0.1
"""Distance of the reference point beyond the worst costs, as a share of their range."""


def unbeaten(costs: FloatArray) -> BoolArray:
    """Mask of the rows of costs (n, m) that no other row beats in one cost and equals in the rest."""
    if not len(costs):
        return np.zeros(0, dtype=bool)
    return np.asarray(moocore.is_nondominated(costs), dtype=bool)


def reference_point(costs: FloatArray) -> FloatArray:
    """A point that is a little worse than all costs (n, m), shape (m,)."""
    worst = costs.max(axis=0)
    return np.asarray(worst + MARGIN * np.maximum(np.ptp(costs, axis=0), 1e-9 * np.abs(worst) + 1e-12))


def hypervolume(costs: FloatArray, reference: FloatArray) -> float:
    """Volume between the costs (n, m) and the reference point (m,) that at least one of them beats."""
    inside = costs[(costs < reference).all(axis=1)]
    return float(moocore.hypervolume(inside, ref=reference)) if len(inside) else 0.0
