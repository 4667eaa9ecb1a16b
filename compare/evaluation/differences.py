"""Differences of fields over the whole body: of a solver from the reference, the truth, or a better field."""

from collections.abc import Mapping
from math import nan
from typing import Annotated, Self

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict

from pinnray.runtime.arrays import FloatArray, weighted_percentile

COMPONENTS: dict[str, tuple[int, int]] = {"xx": (0, 0), "yy": (1, 1), "xy": (0, 1)}
"""Components of a symmetric tensor in the plane."""

Number = Annotated[float, BeforeValidator(lambda value: nan if value is None else value)]
"""A number; NaN, for which JSON has no word, is null in a file."""


class Numbers(BaseModel):
    """Numbers that belong together, from the attributes of an object or from a file."""

    model_config = ConfigDict(frozen=True, from_attributes=True)


class FieldDifference(Numbers):
    """Difference of a field from the reference's, over the whole body."""

    rel_l2: Number  #: Area-weighted L2 norm of the difference over the norm of the reference.
    mean: Number  #: Area-weighted mean of the pointwise absolute difference, in the field's unit.
    p95: Number  #: Area-weighted 95th percentile of the pointwise absolute difference.

    @classmethod
    def of(cls, values: FloatArray, reference: FloatArray, weights: FloatArray) -> Self:
        """Difference of two fields given at quadrature points.

        Args:
            values: Shape (q,) or (q, k).
            reference: Of the same shape.
            weights: Quadrature weights, shape (q,), mm^2.
        """
        size = _magnitude(values - reference)
        return cls(
            rel_l2=relative_l2(values, reference, weights),
            mean=float((weights * size).sum() / weights.sum()),
            p95=weighted_percentile(size, weights, 95),
        )


def relative_l2(values: FloatArray, reference: FloatArray, weights: FloatArray) -> float:
    """The first number of `FieldDifference.of`, with its arguments; NaN for a reference of zeros."""
    size, norm = (
        np.sqrt((weights * _magnitude(each) ** 2).sum()) for each in (values - reference, reference)
    )
    return float(size / norm) if norm > 0 else nan


def _magnitude(values: FloatArray) -> FloatArray:
    return np.abs(values) if values.ndim == 1 else np.asarray(np.linalg.norm(values, axis=1))


class Differences(Numbers):
    """Differences of a solver from the reference on the shared mesh, or of the exact solution from it."""

    rel_l2_displacement: Number
    rel_l2_von_mises: Number
    mae_markers: Number  #: Mean over the markers of `|du| + |dv|`, mm.
    rel_energy: Number  #: Relative difference of the energy, signed.
    displacement: FieldDifference  #: Of the displacement vector, mm.
    von_mises: FieldDifference  #: MPa.
    stress: Mapping[str, FieldDifference]  #: Of the in-plane Cauchy stress components, by name, MPa.
    strain: Mapping[str, FieldDifference]  #: Of the in-plane strain components, by name.
