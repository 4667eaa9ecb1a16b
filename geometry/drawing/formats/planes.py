"""Planes in space and the two axes in which a section lies in them."""

import re

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError

NUMBER = r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[-+]?[0-9]+)?"
TERM = f"([-+]?)({NUMBER})?([xyz])"


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
    """Unit normal, shape (3,), and offset of a plane given as `z = 6` or `0.6 x + 0.8 z = 5`."""
    left, equals, right = (part.replace(" ", "").replace("*", "") for part in text.lower().partition("="))
    normal, length = np.zeros(3), 0.0
    if equals and re.fullmatch(f"(?:{TERM})+", left) and re.fullmatch(f"[-+]?{NUMBER}", right):
        for sign, number, axis in re.findall(TERM, left):
            normal["xyz".index(axis)] += float(f"{sign}{number or 1}")
        length = float(np.linalg.norm(normal))
    if not 0 < length < np.inf or not np.isfinite(float(right)):
        raise UserError(f'cannot read the plane {text!r}; write such as "z = 6" or "0.6 x + 0.8 z = 5"')
    return normal / length, float(right) / length


def plane_text(normal: FloatArray, offset: float) -> str:
    """A plane in words, such as `z = 6`, which `plane_of` reads."""
    if np.abs(normal).max() > 1 - 1e-9:
        which = int(np.abs(normal).argmax())
        return f"{'xyz'[which]} = {round(offset * np.sign(normal[which]), 9) + 0.0:.6g}"
    terms = (f"{value:+.6g} {axis}" for value, axis in zip(normal, "xyz", strict=True) if abs(value) > 1e-9)
    return f"{' '.join(terms)} = {offset:.6g}"
