"""Tracking from frame to frame, by prediction, with a search around the finger for lost markers."""

from contextlib import suppress
from typing import NamedTuple

import numpy as np

from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.runtime.errors import UserError
from pinnray.vision.discs.colour import DARK
from pinnray.vision.discs.disc_detector import DiscDetections, detect_discs, detect_discs_near
from pinnray.vision.frames.frame import Image
from pinnray.vision.tracking.data_association import (
    associate_markers,
    distance_from_base,
    rest_covariances,
    step_covariances,
    with_predictions,
)
from pinnray.vision.tracking.scene import FilmedScene

FEWEST = 3
"""Number of markers that must be identified in the first frame."""
AROUND = 15.0
"""Search distance around the markers for a lost one, mm."""
LIVE_PERIOD = 5
"""Period, in frames of a live film, of searches for markers that stay lost and of detecting the fiducials."""
SAME_SIZE = 1.3
"""Ratio of the radii of a disc and of a marker beyond which the disc is no marker."""
SAME_CONTRAST = 5.0
"""Largest ratio of the contrasts, for uneven light; a disc of the other sign is no marker either."""


class FrameDetections(NamedTuple):
    """Markers and fiducials in a frame.

    Attributes:
        markers: Every marker, shape (m, ...); nan where it was not detected.
        fiducials: Every fiducial of the workspace, shape (f, ...); nan where it was not detected. None in a
            frame in which they were not searched for.
        places: Positions of the markers, predicted ones if not detected, shape (m, 2), mm, by the plane of
            the first frame.
        guesses: The same in the image, pixels.
    """

    markers: DiscDetections
    fiducials: DiscDetections | None
    places: FloatArray
    guesses: FloatArray


class FrameTracker:
    """Tracks the markers in one frame after another.

    Args:
        scene: The filmed scene.
        image: The first frame.
        live: Whether to save time: detect the fiducials, and search for markers that stay lost, in every
            fifth frame only.

    Attributes:
        plane: Of the markers, from the first frame.
        first: Detections in that frame.

    Raises:
        UserError: If the first frame shows too few fiducials or markers.
    """

    def __init__(self, scene: FilmedScene, image: Image, *, live: bool = False) -> None:
        self._scene, self._period, self._number = scene, LIVE_PERIOD if live else 1, 0
        self.plane, self._fiducials = scene.first_plane(image)
        self._hidden = int(np.isnan(self._fiducials.radii).sum())
        self._rest = self._places = scene.design.markers
        self._step = np.zeros_like(self._rest)
        self._reach = distance_from_base(scene.design.section, self._rest)
        self._steps = step_covariances(self._rest, self._reach)
        self._size, self._contrast = 1.0, np.nan
        detections = self._search(image, sized=False)
        fields = rest_covariances(self._rest)
        names = self._associated(detections, fields)
        if (seen := names >= 0).any():
            self._contrast = float(np.median(detections.contrasts[names[seen]]))
            self._size = float(np.median(detections.radii[names[seen]] / self._radii(self._rest)[seen]))
            detections, names = self._searched(detections, names, fields, image)
        count, least = int((names >= 0).sum()), min(FEWEST, len(names))
        if count < least:
            raise UserError(
                f"{count} of {len(names)} markers are where the design has them, and {least} must be; show "
                "the finger before it is pressed, and give its design, the markers' colour, and the "
                "workspace: where the fiducials lie around the finger, and how much nearer to the camera the "
                f"markers are (marker_plane, here {scene.workspace.marker_plane:g} mm), which only a "
                "calibrated camera accounts for"
            )
        self._lost = 1  # frames since the last search
        self.first = self._accepted(detections, names, image)
        self._step = np.zeros_like(self._rest)

    def see(self, image: Image) -> FrameDetections:
        """Track the markers into the next frame."""
        detections = self._detected_near(image, self._places + self._step)
        names = self._associated(detections, self._steps)
        missing = int((names < 0).sum())
        if missing > self._missing or (missing and self._lost >= self._period):
            self._lost = 0
            detections, names = self._searched(detections, names, self._steps, image)
        self._lost += 1
        return self._accepted(detections, names, image)

    def _detected_near(self, image: Image, places: FloatArray) -> DiscDetections:
        """Detect discs near places, shape (m, 2), mm."""
        scene, guesses = self._scene, self.plane.pixels(places)
        return detect_discs_near(image, scene.colour, guesses, self._radii(places), scene.method)

    def _searched(
        self, detections: DiscDetections, names: IntArray, fields: FloatArray, image: Image
    ) -> tuple[DiscDetections, IntArray]:
        """Add the discs of a search, then those near the places that the identified ones predict."""
        detections = detections.together(self._search(image))
        names = self._associated(detections, fields)
        if 0 < (names < 0).sum() < len(names):
            places = self._places + self._steps_of(detections.numbered(names))
            detections = detections.together(self._detected_near(image, places))
            names = self._associated(detections, fields)
        return detections, names

    def _steps_of(self, markers: DiscDetections) -> FloatArray:
        """Steps of the markers from their places, predicted for undetected ones, shape (m, 2), mm."""
        known = np.isfinite(markers.radii)
        step = np.full_like(self._places, np.nan)
        step[known] = self.plane.points(markers.centres[known]) - self._places[known]
        return with_predictions(self._rest, self._reach, step)

    def _search(self, image: Image, *, sized: bool = True) -> DiscDetections:
        """Detect discs of the markers' size in the part of the image that the finger can reach."""
        (x0, y0), (x1, y1) = self._places.min(axis=0) - AROUND, self._places.max(axis=0) + AROUND
        corners = self.plane.pixels(np.array([(x0, y0), (x0, y1), (x1, y0), (x1, y1)]))
        low, high = np.floor(corners.min(axis=0)).astype(int), np.ceil(corners.max(axis=0)).astype(int) + 1
        radii = self._radii(self._places)
        limits = (radii.min() / SAME_SIZE, radii.max() * SAME_SIZE)
        window = (int(low[0]), int(low[1]), int(high[0]), int(high[1]))
        known = (lambda pixels: self._radii(self.plane.points(pixels))) if sized else None
        return detect_discs(image, self._scene.colour, limits, self._scene.method, window, known)

    def _associated(self, detections: DiscDetections, fields: FloatArray) -> IntArray:
        """The number of its disc for every marker, shape (m,); -1 if it has none."""
        ratio = detections.contrasts / self._contrast
        alike = np.nonzero(~((ratio < 1 / SAME_CONTRAST) | (ratio > SAME_CONTRAST)))[0]  # nan is not known
        names = associate_markers(self.plane.points(detections.centres[alike]), self._places, fields)
        return np.where(names >= 0, np.append(alike, -1)[names], -1)

    def _radii(self, places: FloatArray) -> FloatArray:
        """Radii of markers in the image, shape (m,), pixels."""
        return self._size * self._scene.design.marker_radius * self.plane.scales(places)

    def _accepted(self, detections: DiscDetections, names: IntArray, image: Image) -> FrameDetections:
        """Order the discs by marker and keep the state for the next frame."""
        markers = detections.numbered(names)
        self._missing = int((names < 0).sum())
        self._step = self._steps_of(markers)
        self._places = self._places + self._step
        places = self._places
        return FrameDetections(markers, self._detected_fiducials(image), places, self.plane.pixels(places))

    def _detected_fiducials(self, image: Image) -> DiscDetections | None:
        """The fiducials, shape (f, ...), nan where one was not detected; None if it is not their turn."""
        self._number += 1
        if (self._number - 1) % self._period:
            return None
        old, known = self._fiducials, np.isfinite(self._fiducials.radii)
        discs = np.full(len(known), -1)
        old = old.where(known)
        found = detect_discs_near(image, DARK, old.centres, old.radii, self._scene.method)
        if len(found.radii):
            away = np.linalg.norm(old.centres[:, None] - found.centres, axis=2)
            discs[known] = np.where(away.min(axis=1) < old.radii, away.argmin(axis=1), -1)
        found = found.numbered(discs)
        hidden = int(np.isnan(found.radii).sum())
        if hidden > max(self._hidden, len(known) / 2):  # most at once: rather the camera was moved than they
            with suppress(UserError):
                anew = self._scene.find_fiducials(image)
                if np.isnan(anew.radii).sum() < hidden:
                    self._fiducials = found = anew
        self._hidden = hidden
        return found
