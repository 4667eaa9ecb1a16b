"""The markers from frame to frame: sought where they are expected, and around the finger if one is lost."""

from typing import NamedTuple

import numpy as np

from geometry.arrays import FloatArray, IntArray
from geometry.errors import UserError
from geometry.finger.markers import marker_positions
from vision.discs.colour import DARK
from vision.discs.disc_detector import Spots, follow, look
from vision.frames.frame import Image
from vision.tracking.data_association import filled, identify, moved, placed
from vision.tracking.fiducials import UnseenError
from vision.tracking.marker_plane import Plane
from vision.tracking.scene import Fiducials, Setup

FEWEST = 3
"""Markers without which a finger is not known."""
AROUND = 15.0
"""How far around the markers a lost one is looked for, mm."""
LIVE_PERIOD = 5
"""Frames between two searches for markers that stay lost, and between two looks at the fiducials, which do
not move, where there is no time for more."""
SAME_SIZE = 1.3
"""Ratio of the radii of a disc and of a marker beyond which the disc is no marker."""
SAME_CONTRAST = 5.0
"""Ratio of the contrasts, which uneven light explains; a disc of the other sign is no marker either."""


class Sighting(NamedTuple):
    """What a frame shows.

    Attributes:
        markers: Every marker, shape (m, ...); nan where it was not seen.
        fiducials: Every fiducial of the workspace, shape (f, ...); nan where it was not seen.
        places: Where the markers are, or probably are if they were not seen, shape (m, 2), mm, by the plane
            of the first frame.
        guesses: The same in the image, pixels.
    """

    markers: Spots
    fiducials: Spots
    places: FloatArray
    guesses: FloatArray


def _plane_of(setup: Setup, image: Image) -> tuple[Plane, Fiducials]:
    """The markers' plane in the first frame, and the fiducials that gave it; none if the markers did."""
    try:
        fiducials = setup.find_fiducials(image)
        return setup.plane(fiducials), fiducials
    except UnseenError:
        if not setup.alone:
            raise
        return setup.find_alone(image), Fiducials(np.empty(0, dtype=np.int64), Spots.none())


class Follower:
    """Knows the markers in one frame after another.

    Args:
        setup: What the frames show.
        image: The first of them.
        live: Whether time matters: the fiducials, and markers that stay lost, are then looked for in every
            fifth frame only.

    Attributes:
        plane: Of the markers, as the first frame shows it.
        first: What that frame shows.

    Raises:
        UserError: If the first frame shows too few fiducials or markers.
    """

    def __init__(self, setup: Setup, image: Image, *, live: bool = False) -> None:
        self._setup, self._period, self._number = setup, LIVE_PERIOD if live else 1, 0
        self.plane, self._fiducials = _plane_of(setup, image)
        self._rest = self._places = marker_positions(setup.design)
        self._step = np.zeros_like(self._rest)
        self._steps = moved(self._rest)
        self._size, self._contrast = 1.0, np.nan
        spots = self._search(image, sized=False)
        fields = placed(self._rest)
        names = self._named(spots, fields)
        if (seen := names >= 0).any():
            self._contrast = float(np.median(spots.contrasts[names[seen]]))
            self._size = float(np.median(spots.radii[names[seen]] / self._radii(self._rest)[seen]))
            spots, names = self._sought(spots, names, fields, image)
        count, least = int((names >= 0).sum()), min(FEWEST, len(names))
        if count < least:
            raise UserError(
                f"{count} of {len(names)} markers are where the design has them, and {least} must be; "
                "show the finger before it is pressed, and give its design, workspace and markers' colour"
            )
        self._lost = 0
        self.first = self._sighting(spots, names, image)
        self._step = np.zeros_like(self._rest)

    def see(self, image: Image) -> Sighting:
        """What the next frame shows."""
        spots = self._follow(image, self._places + self._step)
        names = self._named(spots, self._steps)
        missing = int((names < 0).sum())
        if missing > self._missing or (missing and self._lost >= self._period):
            self._lost = 0
            spots, names = self._sought(spots, names, self._steps, image)
        self._lost += 1
        return self._sighting(spots, names, image)

    def _follow(self, image: Image, places: FloatArray) -> Spots:
        """Discs near places, shape (m, 2), mm."""
        setup = self._setup
        return follow(image, setup.colour, self.plane.pixels(places), self._radii(places), setup.method)

    def _sought(
        self, spots: Spots, names: IntArray, fields: FloatArray, image: Image
    ) -> tuple[Spots, IntArray]:
        """Discs and names with those that a search finds, and those that are where the others say."""
        spots = spots.together(self._search(image))
        names = self._named(spots, fields)
        if 0 < (names < 0).sum() < len(names):
            spots = spots.together(self._follow(image, self._places + self._moved(spots.numbered(names))))
            names = self._named(spots, fields)
        return spots, names

    def _moved(self, markers: Spots) -> FloatArray:
        """Steps of the markers from their places, likely ones for those not seen, shape (m, 2), mm."""
        known = np.isfinite(markers.radii)
        step = np.full_like(self._places, np.nan)
        step[known] = self.plane.points(markers.centres[known]) - self._places[known]
        return filled(self._rest, step)

    def _search(self, image: Image, *, sized: bool = True) -> Spots:
        """Discs of the markers' size, perhaps known, in the part of the image that the finger can reach."""
        (x0, y0), (x1, y1) = self._places.min(axis=0) - AROUND, self._places.max(axis=0) + AROUND
        corners = self.plane.pixels(np.array([(x0, y0), (x0, y1), (x1, y0), (x1, y1)]))
        low, high = np.floor(corners.min(axis=0)).astype(int), np.ceil(corners.max(axis=0)).astype(int) + 1
        radii = self._radii(self._places)
        limits = (radii.min() / SAME_SIZE, radii.max() * SAME_SIZE)
        window = (int(low[0]), int(low[1]), int(high[0]), int(high[1]))
        known = (lambda pixels: self._radii(self.plane.points(pixels))) if sized else None
        return look(image, self._setup.colour, limits, self._setup.method, window, known)

    def _named(self, spots: Spots, fields: FloatArray) -> IntArray:
        """The number of its disc for every marker, shape (m,); -1 if it has none."""
        ratio = spots.contrasts / self._contrast
        alike = np.nonzero(~((ratio < 1 / SAME_CONTRAST) | (ratio > SAME_CONTRAST)))[0]  # nan is not known
        names = identify(self.plane.points(spots.centres[alike]), self._places, fields)
        return np.where(names >= 0, np.append(alike, -1)[names], -1)

    def _radii(self, places: FloatArray) -> FloatArray:
        """Of the pictures of markers, shape (m,), pixels."""
        return self._size * self._setup.design.marker_diameter / 2 * self.plane.scales(places)

    def _sighting(self, spots: Spots, names: IntArray, image: Image) -> Sighting:
        """Put in order what was found, and remember it."""
        markers = spots.numbered(names)
        self._missing = int((names < 0).sum())
        self._step = self._moved(markers)
        self._places = self._places + self._step
        places = self._places
        return Sighting(markers, self._fixed(image), places, self.plane.pixels(places))

    def _fixed(self, image: Image) -> Spots:
        """The fiducials, if it is their turn."""
        self._number += 1
        numbers, old = self._fiducials
        discs = np.full(len(self._setup.workspace.fiducials), -1)
        if (self._number - 1) % self._period:
            return old.numbered(discs)
        found = follow(image, DARK, old.centres, old.radii, self._setup.method)
        if len(found.radii):
            away = np.linalg.norm(old.centres[:, None] - found.centres, axis=2)
            discs[numbers] = np.where(away.min(axis=1) < old.radii, away.argmin(axis=1), -1)
        return found.numbered(discs)
