"""The markers from frame to frame: sought where they are expected, and around the finger if one is lost."""

from typing import NamedTuple

import numpy as np

from geometry.arrays import FloatArray, IntArray
from geometry.errors import UserError
from geometry.finger.markers import marker_positions
from vision.discs.colour import DARK
from vision.discs.disc_detector import DiscDetections, detect_discs, detect_discs_near
from vision.frames.frame import Image
from vision.tracking.data_association import (
    associate_markers,
    rest_covariances,
    step_covariances,
    with_predictions,
)
from vision.tracking.fiducial_matching import UnseenError
from vision.tracking.marker_plane import MarkerPlane
from vision.tracking.scene import FilmedScene, FoundFiducials

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


class FrameDetections(NamedTuple):
    """What a frame shows.

    Attributes:
        markers: Every marker, shape (m, ...); nan where it was not seen.
        fiducials: Every fiducial of the workspace, shape (f, ...); nan where it was not seen.
        places: Where the markers are, or probably are if they were not seen, shape (m, 2), mm, by the plane
            of the first frame.
        guesses: The same in the image, pixels.
    """

    markers: DiscDetections
    fiducials: DiscDetections
    places: FloatArray
    guesses: FloatArray


def _plane_of(scene: FilmedScene, image: Image) -> tuple[MarkerPlane, FoundFiducials]:
    """The markers' plane in the first frame, and the fiducials that gave it; none if the markers did."""
    try:
        fiducials = scene.find_fiducials(image)
        return scene.plane(fiducials), fiducials
    except UnseenError:
        if not scene.markers_only:
            raise
        return scene.find_plane_from_markers(image), FoundFiducials(
            np.empty(0, dtype=np.int64), DiscDetections.none()
        )


class FrameTracker:
    """Knows the markers in one frame after another.

    Args:
        scene: What the frames show.
        image: The first of them.
        live: Whether time matters: the fiducials, and markers that stay lost, are then looked for in every
            fifth frame only.

    Attributes:
        plane: Of the markers, as the first frame shows it.
        first: What that frame shows.

    Raises:
        UserError: If the first frame shows too few fiducials or markers.
    """

    def __init__(self, scene: FilmedScene, image: Image, *, live: bool = False) -> None:
        self._scene, self._period, self._number = scene, LIVE_PERIOD if live else 1, 0
        self.plane, self._fiducials = _plane_of(scene, image)
        self._rest = self._places = marker_positions(scene.design)
        self._step = np.zeros_like(self._rest)
        self._steps = step_covariances(self._rest)
        self._size, self._contrast = 1.0, np.nan
        detections = self._search(image, sized=False)
        fields = rest_covariances(self._rest)
        names = self._named(detections, fields)
        if (seen := names >= 0).any():
            self._contrast = float(np.median(detections.contrasts[names[seen]]))
            self._size = float(np.median(detections.radii[names[seen]] / self._radii(self._rest)[seen]))
            detections, names = self._sought(detections, names, fields, image)
        count, least = int((names >= 0).sum()), min(FEWEST, len(names))
        if count < least:
            raise UserError(
                f"{count} of {len(names)} markers are where the design has them, and {least} must be; "
                "show the finger before it is pressed, and give its design, workspace and markers' colour"
            )
        self._lost = 0
        self.first = self._sighting(detections, names, image)
        self._step = np.zeros_like(self._rest)

    def see(self, image: Image) -> FrameDetections:
        """What the next frame shows."""
        detections = self._follow(image, self._places + self._step)
        names = self._named(detections, self._steps)
        missing = int((names < 0).sum())
        if missing > self._missing or (missing and self._lost >= self._period):
            self._lost = 0
            detections, names = self._sought(detections, names, self._steps, image)
        self._lost += 1
        return self._sighting(detections, names, image)

    def _follow(self, image: Image, places: FloatArray) -> DiscDetections:
        """Discs near places, shape (m, 2), mm."""
        scene = self._scene
        return detect_discs_near(
            image, scene.colour, self.plane.pixels(places), self._radii(places), scene.method
        )

    def _sought(
        self, detections: DiscDetections, names: IntArray, fields: FloatArray, image: Image
    ) -> tuple[DiscDetections, IntArray]:
        """Discs and names with those that a search finds, and those that are where the others say."""
        detections = detections.together(self._search(image))
        names = self._named(detections, fields)
        if 0 < (names < 0).sum() < len(names):
            detections = detections.together(
                self._follow(image, self._places + self._moved(detections.numbered(names)))
            )
            names = self._named(detections, fields)
        return detections, names

    def _moved(self, markers: DiscDetections) -> FloatArray:
        """Steps of the markers from their places, likely ones for those not seen, shape (m, 2), mm."""
        known = np.isfinite(markers.radii)
        step = np.full_like(self._places, np.nan)
        step[known] = self.plane.points(markers.centres[known]) - self._places[known]
        return with_predictions(self._rest, step)

    def _search(self, image: Image, *, sized: bool = True) -> DiscDetections:
        """Discs of the markers' size, perhaps known, in the part of the image that the finger can reach."""
        (x0, y0), (x1, y1) = self._places.min(axis=0) - AROUND, self._places.max(axis=0) + AROUND
        corners = self.plane.pixels(np.array([(x0, y0), (x0, y1), (x1, y0), (x1, y1)]))
        low, high = np.floor(corners.min(axis=0)).astype(int), np.ceil(corners.max(axis=0)).astype(int) + 1
        radii = self._radii(self._places)
        limits = (radii.min() / SAME_SIZE, radii.max() * SAME_SIZE)
        window = (int(low[0]), int(low[1]), int(high[0]), int(high[1]))
        known = (lambda pixels: self._radii(self.plane.points(pixels))) if sized else None
        return detect_discs(image, self._scene.colour, limits, self._scene.method, window, known)

    def _named(self, detections: DiscDetections, fields: FloatArray) -> IntArray:
        """The number of its disc for every marker, shape (m,); -1 if it has none."""
        ratio = detections.contrasts / self._contrast
        alike = np.nonzero(~((ratio < 1 / SAME_CONTRAST) | (ratio > SAME_CONTRAST)))[0]  # nan is not known
        names = associate_markers(self.plane.points(detections.centres[alike]), self._places, fields)
        return np.where(names >= 0, np.append(alike, -1)[names], -1)

    def _radii(self, places: FloatArray) -> FloatArray:
        """Of the pictures of markers, shape (m,), pixels."""
        return self._size * self._scene.design.marker_radius * self.plane.scales(places)

    def _sighting(self, detections: DiscDetections, names: IntArray, image: Image) -> FrameDetections:
        """Put in order what was found, and remember it."""
        markers = detections.numbered(names)
        self._missing = int((names < 0).sum())
        self._step = self._moved(markers)
        self._places = self._places + self._step
        places = self._places
        return FrameDetections(markers, self._fixed(image), places, self.plane.pixels(places))

    def _fixed(self, image: Image) -> DiscDetections:
        """The fiducials, if it is their turn."""
        self._number += 1
        numbers, old = self._fiducials
        discs = np.full(len(self._scene.workspace.fiducials), -1)
        if (self._number - 1) % self._period:
            return old.numbered(discs)
        found = detect_discs_near(image, DARK, old.centres, old.radii, self._scene.method)
        if len(found.radii):
            away = np.linalg.norm(old.centres[:, None] - found.centres, axis=2)
            discs[numbers] = np.where(away.min(axis=1) < old.radii, away.argmin(axis=1), -1)
        return found.numbered(discs)
