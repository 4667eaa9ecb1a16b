"""The finger as meshing, filming and comparing see it, whether from parameters or from a drawing."""

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from pinnray.geometry.section.loop import Loop
from pinnray.geometry.section.section import Section
from pinnray.runtime.arrays import FloatArray

if TYPE_CHECKING:
    from pinnray.runtime.figure import Figure


class Finger(Protocol):
    """A soft body with a clamped base, a contact on its front and printed markers.

    Frame: the front face has the contact's middle on y = 0, the body below it and x running from the base to
    the tip. Units: mm. `Design` is a finger from parameters, `DrawnFinger` one from a drawing or a mesh.
    """

    @property
    def name(self) -> str:
        """What files and reports call the finger; no part of the geometry."""

    @property
    def depth(self) -> float:
        """Depth of the extrusion, out of the plane, mm."""

    @property
    def section(self) -> Section:
        """The section, whose outline has pieces called `base` and `front`."""

    @property
    def markers(self) -> FloatArray:
        """Centres of the markers, ordered from base to tip, shape (m, 2), mm."""

    @property
    def marker_layout(self) -> str:
        """Name of the markers' layout, for captions."""

    @property
    def marker_diameter(self) -> float:
        """Diameter of a marker's disc, mm."""

    @property
    def marker_radius(self) -> float:
        """Radius of a marker's disc, mm: a marker's displacement is the mean over this disc."""

    @property
    def marker_height(self) -> float:
        """How deep a marker is inlaid into the side face, mm."""

    @property
    def contact_abscissa(self) -> float:
        """X of the contact's middle on the front face, mm."""

    @property
    def contact_width(self) -> float:
        """Extent of the contact along x, mm."""

    @property
    def contact_ends(self) -> tuple[float, float]:
        """X of both ends of the contact, mm."""

    @property
    def digest(self) -> str:
        """SHA-256 over everything but the name, in hexadecimal; equal for equal fingers."""

    def at_contact(self, position: float) -> "Finger":
        """The same finger with the contact's middle at another x, mm.

        Raises:
            UserError: If the contact is not on the front face there.
        """

    def definition(self) -> dict[str, Any]:
        """Everything that defines the finger, for JSON; `finger_from` reads it back."""

    def facts(self) -> list[tuple[str, str, str]]:
        """Rows of the report: meaning, the paper's symbol or an empty text, and value with unit."""

    def plot(self, width: float | None = None) -> "Figure":
        """The section with clamp, contact and numbered markers, as a matplotlib figure."""


def outline_with_contact(finger: Finger) -> Loop:
    """The outline with corners at the contact's ends and middle, and its pieces between named `contact`."""
    (low, high), loop = finger.contact_ends, finger.section.outline
    nearest = 1e-7  # distance of two places that are one, mm
    for x in (low, finger.contact_abscissa, high):
        which, fraction = Section(loop).front_place(x)
        if nearest < fraction * loop.lengths[which] < loop.lengths[which] - nearest:
            loop = loop.split(which, [fraction])
    for which in loop.pieces("front"):
        ends = np.sort(loop.ends[which, :, 0])
        if ends[0] > low - nearest and ends[1] < high + nearest:
            loop = loop.named(which, "contact")
    return loop
