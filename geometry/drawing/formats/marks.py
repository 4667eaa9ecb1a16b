"""Sorts the markers and the contact's point of a file from the curves that bound its section."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from geometry.arrays import FloatArray
from geometry.drawing.formats.chain import closed_loops
from geometry.drawing.formats.drawing import LABELS, Drawing, place
from geometry.drawing.formats.pieces import Piece
from geometry.errors import UserError

MARKINGS = frozenset(label for label in LABELS if label != "markers")
"""Labels of lines that may lie on top of the boundary."""


class Marks:
    """Markers and contact, as a reader comes across them."""

    def __init__(self) -> None:
        self._centres: list[FloatArray] = []
        self._diameters: list[float] = []
        self._contact: FloatArray | None = None

    def took(self, centre: FloatArray | None, diameter: float, label: str) -> bool:
        """Keep a circle or, with no diameter, a point as a mark; False if it is none."""
        if centre is None:
            return False
        if label == "markers":
            self._centres.append(centre)
            self._diameters.append(diameter)
        elif label == "contact":
            if self._contact is not None:
                raise UserError(f"two points are called contact, {place(self._contact)} and {place(centre)}")
            self._contact = centre
        return label in ("markers", "contact")

    def drawing(self, pieces: Sequence[Piece], **facts: Any) -> Drawing:
        """The drawing with its curves closed.

        Raises:
            UserError: If a curve does not close, the markers differ in diameter, or one is no circle.
        """
        if strange := next((piece for piece in pieces if piece.label == "markers"), None):
            raise UserError(f"the marker at {place(strange.start)} is no circle; draw circles or points")
        sizes = [diameter for diameter in self._diameters if diameter > 0]
        if sizes and np.ptp(sizes) > 1e-3:
            raise UserError(
                f"the markers have diameters from {min(sizes):.4g} to {max(sizes):.4g} mm; give all the same"
            )
        return Drawing(
            loops=closed_loops(pieces, MARKINGS),
            markers=np.array(self._centres).reshape(-1, 2),
            marker_diameter=float(np.mean(sizes)) if sizes else None,
            contact=self._contact,
            **facts,
        )
