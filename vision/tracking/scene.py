"""What is filmed, and how: the finger, the fiducials around it, the camera, the colour of the markers."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from geometry.arrays import BoolArray, FloatArray, IntArray
from geometry.errors import UserError
from geometry.finger.markers import marker_positions
from geometry.finger.parameters import Parameters
from vision.calibration.camera import Camera
from vision.discs.colour import DARK, Colour
from vision.discs.disc_detector import DetectionMethod, DiscDetections, detect_discs
from vision.frames.frame import Image
from vision.tracking.fiducial_matching import identify_fiducials
from vision.tracking.layout_matching import match_layout
from vision.tracking.marker_plane import CameraProjection, MarkerPlane
from vision.tracking.plane_fit import camera_plane, homography_plane, similarity_plane
from vision.tracking.workspace import Workspace

SMALLEST_VIEW = 0.25
"""Least share of the image's diagonal that the fiducials span."""
ASTRAY = 0.5
"""Distance from its place beyond which a fiducial is left out while enough others remain, mm."""
FEWEST = 5
"""Fiducials that are enough."""
LARGEST_RESIDUAL = 0.5
"""Root mean square distance of the fiducials from their places that is accepted with a camera, mm, ..."""
LARGEST_WITHOUT_CAMERA = 3.0
"""... and without one, where the lens shows in it."""


class FoundFiducials(NamedTuple):
    """The fiducials that were found: their numbers, shape (k,), and their discs."""

    numbers: IntArray
    detections: DiscDetections

    def where(self, kept: BoolArray) -> "FoundFiducials":
        """Some of them."""
        return FoundFiducials(self.numbers[kept], self.detections.where(kept))


@dataclass(frozen=True)
class FilmedScene:
    """What is filmed and how it is measured.

    Attributes:
        design: The finger.
        workspace: The fiducials around it.
        camera: The calibrated camera; None if it is not known.
        colour: Of the markers; the fiducials are dark.
        alone: Whether the markers alone may give the plane if the fiducials cannot be made out.
        method: "precise", or "hough" for the paper's pipeline, whose map from pixels to mm is linear.
    """

    design: Parameters
    workspace: Workspace
    camera: Camera | None = None
    colour: Colour = DARK
    method: DetectionMethod = "precise"
    markers_only: bool = False

    def plane(self, fiducials: FoundFiducials) -> MarkerPlane:
        """The markers' plane from fiducials, as exact as the method and what is known allow."""
        points = self.workspace.points[fiducials.numbers]
        centres, covariances = fiducials.detections[:2]
        if self.method == "hough":
            return similarity_plane(points, centres, covariances)
        radius = self.workspace.fiducial_diameter / 2
        plane = self._plane(points, centres, covariances)
        plane = self._plane(points, centres - plane.beside(points, radius), covariances)
        if not isinstance(plane.projection, CameraProjection):
            return plane
        return replace(plane, projection=replace(plane.projection, height=self.workspace.marker_plane))

    def plane_from_markers(self, centres: FloatArray, covariances: FloatArray) -> MarkerPlane:
        """The plane without fiducials, from the markers at rest, (m, 2), pixels; nan for hidden ones."""
        seen = np.isfinite(centres).all(axis=1)
        return similarity_plane(marker_positions(self.design)[seen], centres[seen], covariances[seen])

    def find_plane_from_markers(self, image: Image) -> MarkerPlane:
        """The plane without fiducials, from the markers in the first frame.

        Raises:
            UserError: If they cannot be made out.
        """
        markers, diameter = marker_positions(self.design), self.design.marker_diameter
        largest = float(np.linalg.norm(image.shape[:2])) / self.design.height * diameter / 2
        detections = detect_discs(
            image, self.colour, (max(SMALLEST_VIEW * largest, 3.0), largest), self.method
        )
        discs = detections.numbered(match_layout(detections.centres, detections.radii, markers, diameter))
        return self.plane_from_markers(discs.centres, discs.covariances)

    def find_fiducials(self, image: Image) -> FoundFiducials:
        """Find the fiducials in an image.

        Raises:
            UserError: If they are not there, or mirrored, or not where the workspace has them.
        """
        extent = np.linalg.norm(np.ptp(self.workspace.points, axis=0)) + self.workspace.fiducial_diameter
        largest = float(np.linalg.norm(image.shape[:2]) / extent * self.workspace.fiducial_diameter / 2)
        detections = detect_discs(image, DARK, (max(SMALLEST_VIEW * largest, 3.0), largest), self.method)
        straight = detections.centres if self.camera is None else self.camera.undistort(detections.centres)
        discs = identify_fiducials(straight, detections.radii, self.workspace)
        numbers = np.nonzero(discs >= 0)[0]
        found = FoundFiducials(numbers, DiscDetections(*(part[discs[numbers]] for part in detections)))
        while len(found.numbers) > FEWEST:
            missed = self._missed(found)
            if missed.max() <= max(ASTRAY, 3 * float(np.median(missed))):
                break
            found = found.where(np.arange(len(missed)) != missed.argmax())
        limit = LARGEST_WITHOUT_CAMERA if self.camera is None else LARGEST_RESIDUAL
        if (residual := float(np.sqrt(np.mean(self._missed(found) ** 2)))) > limit:
            raise UserError(
                f"the fiducials lie {residual:.2f} mm from where the workspace has them, more than {limit:g} "
                "mm; give the workspace and the camera of the video"
            )
        return found

    def _missed(self, fiducials: FoundFiducials) -> FloatArray:
        """How far fiducials are from their places, shape (k,), mm."""
        points = self.workspace.points[fiducials.numbers]
        plane = self._plane(points, *fiducials.detections[:2])
        return np.asarray(np.linalg.norm(plane.points(fiducials.detections.centres) - points, axis=1))

    def _plane(self, points: FloatArray, centres: FloatArray, covariances: FloatArray) -> MarkerPlane:
        """The plane of the fiducials themselves."""
        if self.camera is None:
            return homography_plane(points, centres, covariances)
        return camera_plane(self.camera, points, centres, covariances)


def check_size(camera: Camera | None, size: tuple[int, int], name: str) -> None:
    """Refuse frames of another size than the camera's."""
    if camera is not None and (camera.width, camera.height) != size:
        raise UserError(
            f"{name} has {size[0]}x{size[1]} pixels, but the camera was calibrated with "
            f"{camera.width}x{camera.height}; calibrate it at the size of the video"
        )
