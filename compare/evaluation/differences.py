"""Differences of fields over the whole body: of a solver from the reference, the truth, or a better field."""

from collections.abc import Mapping
from math import nan
from typing import Annotated, Any, Self

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict

from pinnray.runtime.arrays import FloatArray

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
        norm = np.sqrt((weights * _magnitude(reference) ** 2).sum())
        return cls(
            rel_l2=float(np.sqrt((weights * size**2).sum()) / norm) if norm > 0 else nan,
            mean=float((weights * size).sum() / weights.sum()),
            p95=weighted_percentile(size, weights, 95),
        )


def _magnitude(values: FloatArray) -> FloatArray:
    return np.abs(values) if values.ndim == 1 else np.asarray(np.linalg.norm(values, axis=1))


def weighted_percentile(values: FloatArray, weights: FloatArray, percent: float) -> float:
    """The value below which `percent` of the total weight lies."""
    order = np.argsort(values)
    share = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(share, percent / 100 * share[-1])])


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

    @classmethod
    def between(cls, evaluation: Any, reference: Any) -> Self:
        """Differences of an `Evaluation` from another one on the same mesh."""

        def differ(name: str, index: tuple[int, ...] = ()) -> FieldDifference:
            values, other = (getattr(each, name)[:, *index] for each in (evaluation, reference))
            return FieldDifference.of(values, other, reference.weights)

        markers = np.abs(evaluation.marker_displacement - reference.marker_displacement).sum(axis=1)
        energy, own = evaluation.energy, reference.energy
        displacement, von_mises = differ("displacement"), differ("von_mises")
        return cls(
            rel_l2_displacement=displacement.rel_l2,
            rel_l2_von_mises=von_mises.rel_l2,
            mae_markers=float(markers.mean()),
            rel_energy=(energy - own) / own if own else nan,
            displacement=displacement,
            von_mises=von_mises,
            stress={name: differ("stress", index) for name, index in COMPONENTS.items()},
            strain={name: differ("strain", index) for name, index in COMPONENTS.items()},
        )
