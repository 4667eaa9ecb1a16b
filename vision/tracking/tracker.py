"""From frames to the markers' displacements."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from geometry.errors import UserError
from geometry.finger.markers import marker_positions
from vision.discs.disc_detector import FLOOR, DiscDetections
from vision.frames.frame import Frame, Frames
from vision.tracking.camera_motion import CameraMotion, find_camera_motion
from vision.tracking.frame_tracker import FrameDetections, FrameTracker
from vision.tracking.layout_matching import has_half_turn_symmetry
from vision.tracking.rest_detection import find_rest_intervals
from vision.tracking.scene import FilmedScene, FoundFiducials, check_size
from vision.tracking.trajectories import Tracking, mean_detections, plane_positions

FAR = 0.5
"""Root mean square distance of the markers at rest from the design's, mm, that is worth a word."""
SHAKE = 0.3
"""Way of the fiducials between start and end that is worth a word, pixels."""


def ignore(frame: Frame, detections: FrameDetections) -> None:
    """Watch nothing."""


def track(
    frames: Frames, scene: FilmedScene, watch: Callable[[Frame, FrameDetections], None] = ignore
) -> Tracking:
    """Track the markers through a video.

    The plane comes from the fiducials in all frames at rest; the displacements are those of the markers'
    means over the frames at rest, from before to after the motion; if the camera moved between them, the
    fiducials undo it. What has no end of its own, a camera or a pipe, is ended by an interrupt from the
    keyboard.

    Args:
        frames: From the finger at rest until it is held.
        scene: What they show.
        watch: Is told what every frame shows, while it is tracked.

    Raises:
        UserError: If the frames do not show what they should; one line says what is amiss.
    """
    check_size(scene.camera, frames.size, frames.name)
    times: list[float] = []
    per_frame: list[FrameDetections] = []
    tracker = None
    try:
        for frame in frames:
            if tracker is None:
                tracker = FrameTracker(scene, frame.image, live=frames.count is None)
                detections = tracker.first
            else:
                detections = tracker.see(frame.image)
            times.append(frame.time)
            per_frame.append(detections)
            watch(frame, detections)
    except KeyboardInterrupt:
        if frames.count is not None:
            raise
    if tracker is None:
        raise UserError(f"{frames.name} has no frame")
    pixels = np.stack([detections.markers.centres for detections in per_frame])
    positions = plane_positions(tracker.plane, pixels, scene.design)
    scale = tracker.plane.scales(marker_positions(scene.design)).mean()
    rest = find_rest_intervals(positions, noise=FLOOR[scene.method] / scale)
    still = [[per_frame[number] for number in end] for end in rest]
    initial, final = (mean_detections([s.markers for s in end], scene.method) for end in still)
    anchors = [
        mean_detections([s.fiducials for s in end], scene.method) for end in (*still, still[0] + still[1])
    ]
    numbers = np.nonzero(np.isfinite(anchors[2].radii))[0]
    markers_only = not len(numbers)
    if markers_only:
        plane = scene.plane_from_markers(initial.centres, initial.covariances)
    else:
        motion = find_camera_motion(scene, anchors[0], anchors[1])
        plane = (
            motion.planes[0]
            if motion.planes
            else scene.plane(FoundFiducials(numbers, anchors[2].where(numbers)))
        )
        final = motion.undone(final)
    tracking = Tracking(
        design=scene.design,
        expected=marker_positions(scene.design),
        times=np.array(times),
        pixels=pixels,
        covariances=np.stack([detections.markers.covariances for detections in per_frame]),
        plane=plane,
        rest=rest,
        initial=initial,
        final=final,
        method=scene.method,
    )
    if markers_only:
        return _by_the_motion(scene, tracking)
    return replace(tracking, warnings=tuple(_remarks(scene, tracking, anchors[1], motion)))


def _by_the_motion(scene: FilmedScene, tracking: Tracking) -> Tracking:
    """What was tracked without fiducials, the right way round: a finger is pressed in on its front face.

    Raises:
        UserError: If the markers move out of that face and do not look the same from both ends.
    """
    turned = _pressed(tracking) > 0
    if turned:
        if not has_half_turn_symmetry(tracking.expected):
            raise UserError(
                "the markers move out of the front face: the image is mirrored; flip it, or show fiducials"
            )
        initial, final = (
            DiscDetections(*(part[::-1] for part in end)) for end in (tracking.initial, tracking.final)
        )
        tracking = replace(
            tracking,
            pixels=tracking.pixels[:, ::-1],
            covariances=tracking.covariances[:, ::-1],
            plane=scene.plane_from_markers(initial.centres, initial.covariances),
            initial=initial,
            final=final,
        )
    a, b = tracking.plane.parameters[:2]
    remark = (
        f"no fiducials: scale and turn are those that put the markers at rest on the design's, "
        f"{tracking.plane.residual:.3f} mm (rms) off; lens and tilt are not undone"
    )
    upside_down = (
        f"the finger points at {np.degrees(np.arctan2(-b, a)) % 360:.0f} degrees in the image, by its motion"
    )
    return replace(tracking, warnings=(remark, upside_down) if turned else (remark,))


def _pressed(tracking: Tracking) -> float:
    """Mean displacement along y of the visible markers, mm."""
    before, after = (
        plane_positions(tracking.plane, end.centres, tracking.design)
        for end in (tracking.initial, tracking.final)
    )
    return float(np.nanmean((after - before)[:, 1]))


def _remarks(
    scene: FilmedScene, tracking: Tracking, after: DiscDetections, motion: CameraMotion
) -> Iterator[str]:
    """What a person should know; `after` are the fiducials."""
    residual = tracking.plane.residual
    if scene.camera is None and scene.method == "precise":
        yield f"no camera: its lens is not undone; the fiducials are {residual:.3f} mm (rms) off their places"
        if scene.workspace.marker_plane:
            yield "no camera: the height of the markers above the fiducials is not accounted for"
    elif scene.camera is not None and scene.camera.covariance is None:
        yield "the camera file has no covariance, so the standard deviations leave the camera's errors out"
    if (hidden := int(np.isnan(after.radii).sum())) > 0:
        yield f"{hidden} of {len(after.radii)} fiducials were not seen"
    if motion.shift > SHAKE:
        known = "which they undo" if motion.planes else "and too few of them are seen to undo it"
        yield (
            f"the fiducials moved by {motion.shift:.2f} pixels between start and end: the camera was not at "
            f"rest, {known}"
        )
    far = float(np.sqrt(np.nanmean((tracking.offsets**2).sum(axis=1))))
    if far > FAR:
        yield f"at rest the markers are {far:.2f} mm (rms) from where the design has them"
    if not tracking.visible.all():
        names = ", ".join(str(number + 1) for number in np.nonzero(~tracking.visible)[0])
        yield f"not seen at rest both before and after, so reported missing: marker {names}"
