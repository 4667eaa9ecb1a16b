"""Checked, read-only arrays; and the percentiles of weighted ones."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pinnray.runtime.errors import ShapeError, UserError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def frozen_array(
    values: ArrayLike, *, dtype: type[Any], shape: Sequence[int | None], name: str
) -> NDArray[Any]:
    """A read-only copy of `values` with a checked shape.

    Args:
        values: The values.
        dtype: Type of the entries.
        shape: Expected shape; None stands for any length.
        name: Name of the array in an error message.

    Returns:
        Read-only array of that type and shape.

    Raises:
        ShapeError: If the shape differs.
        UserError: If an entry is no number of that type, masked or not finite.
    """
    if isinstance(values, np.ma.MaskedArray) and np.any(values.mask):
        raise UserError(f"{name} holds masked values; leave those points out")
    if np.iscomplexobj(values):
        raise UserError(f"{name} holds complex numbers")
    try:
        array = np.array(values, dtype=dtype)
    except (TypeError, ValueError):
        raise UserError(f"{name} holds something that is no number, or rows of different lengths") from None
    wanted = tuple("n" if length is None else length for length in shape)
    if array.ndim != len(shape) or any(
        length is not None and length != actual for length, actual in zip(shape, array.shape, strict=True)
    ):
        raise ShapeError(f"{name} must have shape {wanted}, got {array.shape}")
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise UserError(f"{name} holds a value that is not finite")
    array.setflags(write=False)
    return array


def weighted_percentile(values: FloatArray, weights: FloatArray, percent: float) -> float:
    """The value below which `percent` of the total weight lies."""
    order = np.argsort(values)
    share = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(share, percent / 100 * share[-1])])
