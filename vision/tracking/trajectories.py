"""Marker trajectories, rest positions, and displacements with covariances from a video."""

from dataclasses import dataclass, replace

import numpy as np

from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.observations import Observations
from pinnray.geometry.picture_frame import FIXED, Registration
from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.runtime.errors import UserError
from pinnray.vision.discs.disc_detector import DetectionMethod, DiscDetections
from pinnray.vision.tracking.alignment import Alignment, align
from pinnray.vision.tracking.marker_plane import MarkerPlane
from pinnray.vision.tracking.rest_detection import RestIntervals


@dataclass(frozen=True, eq=False)
class Tracking:
    """The markers in a video of f frames.

    Attributes:
        design: The finger.
        expected: Where its markers should be before loading, shape (m, 2), mm.
        times: Of the frames, shape (f,), s.
        pixels: Of the markers, shape (f, m, 2); nan where one was not detected.
        covariances: Of the pixels, shape (f, m, 2, 2), pixels².
        plane: From pixels to the finger's frame.
        rest: The frames before and after the motion.
        initial, final: Means of the markers over those frames.
        method: How the markers were detected.
        warnings: For the user, one line each.
        simulated: True if the film or its workspace is of the virtual rig.
        final_plane: The plane at the end, if the camera has moved; None if it is `plane`.
        alignment: Of the film's frame with the drawing, which the planes have; None where they have none.
        pressed: How well the frame of the final frames is known in that of the initial ones.
    """

    design: Finger
    expected: FloatArray
    times: FloatArray
    pixels: FloatArray
    covariances: FloatArray
    plane: MarkerPlane
    rest: RestIntervals
    initial: DiscDetections
    final: DiscDetections
    method: DetectionMethod
    warnings: tuple[str, ...] = ()
    simulated: bool = False
    final_plane: MarkerPlane | None = None
    alignment: Alignment | None = None
    pressed: Registration = FIXED

    @property
    def visible(self) -> BoolArray:
        """Mask of the markers that were detected before and after the motion, shape (m,)."""
        return np.asarray(np.isfinite(self.initial.radii + self.final.radii))

    @property
    def positions(self) -> FloatArray:
        """Positions of the markers in every frame, shape (f, m, 2), mm; nan where one was not detected."""
        return self.plane.circles(self.pixels, self.design.marker_radius)

    @property
    def rest_positions(self) -> tuple[FloatArray, FloatArray]:
        """Initial and final positions of the markers at rest, shapes (m, 2), mm; nan if not detected."""
        plane, radius = self.plane, self.design.marker_radius
        return plane.circles(self.initial.centres, radius), plane.circles(self.final.centres, radius)

    def aligned(self) -> "Tracking":
        """The tracking in the frame in which the markers at rest are nearest to the design's."""
        found = align(np.where(self.visible[:, None], self.rest_positions[0], np.nan), self.expected)
        if found is None:
            return self
        final = self.final_plane and self.final_plane.aligned(found.similarity)
        plane = self.plane.aligned(found.similarity)
        return replace(self, plane=plane, final_plane=final, alignment=found)

    @property
    def offsets(self) -> FloatArray:
        """Initial positions minus those of the design, shape (m, 2), mm; nan for markers not visible."""
        return np.where(self.visible[:, None], self.rest_positions[0] - self.expected, np.nan)

    @property
    def displacement_covariance(self) -> FloatArray:
        """Covariance of the visible displacements, shape (2 v, 2 v), mm², in the order u1, v1, u2, ..."""
        seen = self.visible
        before, after = (positions[seen] for positions in self.rest_positions)
        noise = (self.initial.covariances[seen], self.final.covariances[seen])
        return self.plane.displacement_covariance(before, after, *noise)

    def observations(self, source: str) -> Observations:
        """The displacements, final minus initial; markers that are not visible are where the design has them.

        So are all of the method "hough", whose linear map does not find places: the lens shifts them.

        Raises:
            UserError: If no marker is visible, or one lies outside the finger.
        """
        seen = self.visible
        if not seen.any():
            raise UserError("no marker was seen both before and after the motion; show them all at rest")
        points = self.expected.copy()
        displacements, deviations = np.zeros_like(points), np.zeros_like(points)
        initial, final = self.rest_positions
        if self.method != "hough":
            points[seen] = initial[seen]
        displacements[seen] = (final - initial)[seen]
        deviations[seen] = np.sqrt(np.diag(self.displacement_covariance)).reshape(-1, 2)
        if (outside := ~self.design.section.contains(points)).any():
            number = int(outside.argmax())
            x, y = points[number]
            wanted_x, wanted_y = self.expected[number]
            raise UserError(
                f"marker {number + 1} was seen at ({x:.2f}, {y:.2f}) mm, outside the finger; the design has "
                f"it at ({wanted_x:.2f}, {wanted_y:.2f}) mm: give the design and the workspace of the video"
            )
        return Observations(
            points,
            displacements,
            deviations,
            seen,
            source,
            simulated=self.simulated,
            marker_radius=self.design.marker_radius,
            pressed=self.pressed,
            drawn=self.alignment.drawn if self.alignment else FIXED,
        )
