"""Differences of fields over the body."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from geometry.arrays import FloatArray


class FieldDifference(NamedTuple):
    """Difference of a field from the reference's, over the whole body."""

    rel_l2: float  #: Area-weighted L2 norm of the difference over the norm of the reference.
    mean: float  #: Area-weighted mean of the pointwise absolute difference, in the field's unit.
    p95: float  #: Area-weighted 95th percentile of the pointwise absolute difference.


class ReferenceDifferences(NamedTuple):
    """Differences of a solver from the reference on the shared mesh, or of the exact solution from it."""

    displacement: FieldDifference  #: Of the displacement vector, mm.
    von_mises: FieldDifference  #: MPa.
    stress: Mapping[str, FieldDifference]  #: Of the in-plane Cauchy stress components, by name, MPa.
    strain: Mapping[str, FieldDifference]  #: Of the in-plane strain components, by name.
    mae_markers: float  #: Mean over the markers of `|du| + |dv|`, mm.
    energy: float  #: Relative difference of the energy, signed.


def field_difference(values: FloatArray, reference: FloatArray, weights: FloatArray) -> FieldDifference:
    """Difference of two fields given at quadrature points.

    Args:
        values: Shape (q,) or (q, k).
        reference: Of the same shape.
        weights: Quadrature weights, shape (q,), mm^2.
    """
    size = _magnitude(values - reference)
    norm = np.sqrt((weights * _magnitude(reference) ** 2).sum())
    return FieldDifference(
        rel_l2=float(np.sqrt((weights * size**2).sum()) / norm) if norm > 0 else float("nan"),
        mean=float((weights * size).sum() / weights.sum()),
        p95=weighted_percentile(size, weights, 95),
    )


def weighted_percentile(values: FloatArray, weights: FloatArray, percent: float) -> float:
    """The value below which `percent` of the total weight lies."""
    order = np.argsort(values)
    share = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(share, percent / 100 * share[-1])])


def _magnitude(values: FloatArray) -> FloatArray:
    return np.abs(values) if values.ndim == 1 else np.asarray(np.linalg.norm(values, axis=1))
