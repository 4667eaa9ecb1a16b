"""The filmed scene: the finger, the fiducials around it, the camera, the colour of the markers."""

from dataclasses import dataclass

import numpy as np

from pinnray.geometry.finger.finger import Finger
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.vision.calibration.camera import Camera
from pinnray.vision.discs.colour import DARK, Colour
from pinnray.vision.discs.disc_detector import DetectionMethod, DiscDetections, detect_discs
from pinnray.vision.frames.frame import Image
from pinnray.vision.tracking.fiducial_matching import UnseenError, identify_fiducials
from pinnray.vision.tracking.layout_matching import match_layout
from pinnray.vision.tracking.marker_plane import MarkerPlane
from pinnray.vision.tracking.plane_fit import (
    camera_plane,
    homography_plane,
    plane_of_markers,
    similarity_plane,
)
from pinnray.vision.tracking.workspace import Workspace

SMALLEST_VIEW = 0.25
"""Smallest share of the image's diagonal that the fiducials span."""
ASTRAY = 0.5
"""Residual beyond which a fiducial is left out while enough others remain, mm."""
FEWEST = 5
"""Number of fiducials that is enough."""
LARGEST_RESIDUAL = 0.5
"""Largest root mean square residual of the fiducials that is accepted with a camera, mm, ..."""
LARGEST_WITHOUT_CAMERA = 3.0
"""... and without one, where the lens shows in it."""


@dataclass(frozen=True)
class FilmedScene:
    """The finger, the fiducials and the camera, and how the markers are measured.

    Attributes:
        design: The finger.
        workspace: The fiducials around it.
        camera: The calibrated camera; None if it is not known.
        colour: Of the markers; the fiducials are dark.
        method: "precise", or "hough" for the paper's pipeline, whose map from pixels to mm is linear; a
            camera then only accounts for the height of the markers above the fiducials.
        markers_only: Whether the markers alone may give the plane if the fiducials cannot be identified.
    """

    design: Finger
    workspace: Workspace
    camera: Camera | None = None
    colour: Colour = DARK
    method: DetectionMethod = "precise"
    markers_only: bool = False

    def plane(self, fiducials: DiscDetections) -> MarkerPlane:
        """The markers' plane from the fiducials, shape (f, ...), nan where one was not detected."""
        seen = np.isfinite(fiducials.radii)
        points, centres, covariances = self.workspace.points[seen], *fiducials.where(seen)[:2]
        height = self.workspace.marker_plane
        if self.method == "hough":
            if self.camera is not None and height:  # where the camera would see the fiducials at that height
                raised = self._fiducial_plane(points, centres, covariances, height=height)
                centres = raised.pixels(points)
            return similarity_plane(points, centres, covariances)
        radius = self.workspace.fiducial_diameter / 2
        plane = self._fiducial_plane(points, centres, covariances)
        centres = centres - plane.beside(points, radius)
        return self._fiducial_plane(points, centres, covariances, height=height)

    def plane_from_markers(self, markers: DiscDetections) -> MarkerPlane:
        """The plane without fiducials, from the markers at rest, shape (m, ...), nan for hidden ones."""
        seen = np.isfinite(markers.radii)
        return plane_of_markers(self.design.markers[seen], *markers.where(seen)[:2])

    def first_plane(self, image: Image) -> tuple[MarkerPlane, DiscDetections]:
        """The markers' plane in the first frame, and the fiducials, all nan if the markers gave it.

        Raises:
            UserError: If it cannot be determined.
        """
        try:
            fiducials = self.find_fiducials(image)
            return self.plane(fiducials), fiducials
        except UnseenError:
            if not self.markers_only:
                raise
        design = self.design
        length = float(np.ptp(design.section.bounds, axis=0).max())
        detections = self._discs(image, self.colour, length, design.marker_diameter)
        numbers = match_layout(detections.centres, detections.radii, design.markers, design.marker_diameter)
        absent = np.full(len(self.workspace.fiducials), -1)
        return self.plane_from_markers(detections.numbered(numbers)), detections.numbered(absent)

    def find_fiducials(self, image: Image) -> DiscDetections:
        """Detect the fiducials in an image, shape (f, ...); nan for those that are not found.

        Raises:
            UserError: If they are not there, or mirrored, or not where the workspace has them.
        """
        diameter = self.workspace.fiducial_diameter
        extent = float(np.linalg.norm(np.ptp(self.workspace.points, axis=0))) + diameter
        detections = self._discs(image, DARK, extent, diameter)
        straight = detections.centres if self.camera is None else self.camera.undistort(detections.centres)
        numbers = identify_fiducials(straight, detections.radii, self.workspace)
        while True:
            found = detections.numbered(numbers)
            residuals = self._residuals(found)
            astray = np.nanmax(residuals) > max(ASTRAY, 3 * float(np.nanmedian(residuals)))
            if not astray or (numbers >= 0).sum() <= FEWEST:
                break
            numbers[np.nanargmax(residuals)] = -1
        limit = LARGEST_WITHOUT_CAMERA if self.camera is None else LARGEST_RESIDUAL
        if (residual := float(np.sqrt(np.nanmean(residuals**2)))) > limit:
            raise UserError(
                f"the fiducials lie {residual:.2f} mm from where the workspace has them, more than {limit:g} "
                "mm; give the workspace and the camera of the video"
            )
        return found

    def _discs(self, image: Image, colour: Colour, extent: float, diameter: float) -> DiscDetections:
        """Discs of a diameter, of which some span an extent that fills most of the image; both in mm."""
        largest = float(np.linalg.norm(image.shape[:2])) / extent * diameter / 2
        return detect_discs(image, colour, (max(SMALLEST_VIEW * largest, 3.0), largest), self.method)

    def _residuals(self, fiducials: DiscDetections) -> FloatArray:
        """Distances of the fiducials from their places, shape (f,), mm; nan where one was not detected."""
        seen, points = np.isfinite(fiducials.radii), self.workspace.points
        centres, covariances = fiducials.where(seen)[:2]
        plane = self._fiducial_plane(points[seen], centres, covariances)
        residuals = np.full(len(points), np.nan)
        residuals[seen] = np.linalg.norm(plane.points(centres) - points[seen], axis=1)
        return residuals

    def _fiducial_plane(self, *fiducials: FloatArray, height: float = 0.0) -> MarkerPlane:
        """The plane at a height, mm, above that of fiducials: their points, pixels and covariances."""
        if self.camera is None:
            return homography_plane(*fiducials)
        return camera_plane(self.camera, *fiducials, height=height)
