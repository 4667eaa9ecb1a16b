"""Planes in space and the two axes in which a section lies in them."""

import re

import numpy as np

from geometry.arrays import FloatArray
from geometry.errors import UserError


def axes_across(normal: FloatArray) -> FloatArray:
    """Two unit vectors across a direction, shape (2, 3): x, y across z; y, z across x; x, z across y.

    Across any other direction the first is the axis of the file that is most nearly so.
    """
    along = np.abs(normal)
    if along.max() > 1 - 1e-9:
        kept = {0: [1, 2], 1: [0, 2], 2: [0, 1]}[int(along.argmax())]
        return np.asarray(np.eye(3)[kept])
    first = np.eye(3)[int(along.argmin())]
    first = first - normal * (first @ normal)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first)])


def plane_of(text: str) -> tuple[FloatArray, float]:
    """Unit normal, shape (3,), and offset of a plane given as `z = 6`."""
    found = re.fullmatch(r"\s*([xyz])\s*=\s*([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*", text)
    if not found:
        raise UserError(f'cannot read the plane {text!r}; write such as "z = 6"')
    return np.eye(3)["xyz".index(found[1])], float(found[2])


def plane_text(normal: FloatArray, offset: float) -> str:
    """A plane in words, such as `z = 6`."""
    if np.abs(normal).max() > 1 - 1e-9:
        which = int(np.abs(normal).argmax())
        return f"{'xyz'[which]} = {round(offset * np.sign(normal[which]), 9) + 0.0:.6g}"
    terms = (f"{value:+.4g} {axis}" for value, axis in zip(normal, "xyz", strict=True))
    return f"{' '.join(terms)} = {offset:.6g}"
