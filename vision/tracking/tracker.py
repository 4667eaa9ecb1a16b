"""Track the markers through a film: from frames to displacements."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from pinnray.geometry.picture_frame import HAND_HELD
from pinnray.runtime.errors import UserError
from pinnray.vision.discs.disc_detector import FLOOR, DiscDetections
from pinnray.vision.frames.frame import Frame, Frames
from pinnray.vision.tracking.camera_motion import CameraMotion, find_camera_motion
from pinnray.vision.tracking.frame_means import mean_detections
from pinnray.vision.tracking.frame_tracker import FrameDetections, FrameTracker
from pinnray.vision.tracking.rest_detection import RestIntervals, find_rest_intervals
from pinnray.vision.tracking.scene import FilmedScene
from pinnray.vision.tracking.trajectories import Tracking

FAR = 0.5
"""Root mean square distance of the markers at rest from the design's, mm, that is worth a warning, ..."""
UNLIKE = 0.1
"""... and the distance that may remain once they are aligned."""
SCALE = 0.003
"""Change of scale between the film and the drawing that is worth a warning."""
SHAKE = 0.3
"""Shift of the fiducials between start and end, pixels, that is worth a warning."""


def track(
    frames: Frames, scene: FilmedScene, watch: Callable[[Frame, FrameDetections], None] | None = None
) -> Tracking:
    """Track the markers through a video.

    The plane comes from the fiducials in all frames at rest. The displacements are differences of the
    markers' means over the frames at rest, before and after the motion, corrected by the fiducials if the
    camera moved in between. A keyboard interrupt ends a source without an end, such as a camera or a pipe.

    Args:
        frames: From the finger at rest until it is held.
        scene: The filmed scene.
        watch: Called with every frame and its detections.

    Raises:
        UserError: If the frames do not show what they should; one line says what is amiss.
    """
    camera, (width, height) = scene.camera, frames.size
    if camera is not None and (camera.width, camera.height) != frames.size:
        raise UserError(
            f"{frames.name} has {width}x{height} pixels, but the camera was calibrated with "
            f"{camera.width}x{camera.height}; calibrate it at the size of the video"
        )
    times: list[float] = []
    detections: list[FrameDetections] = []
    tracker = None
    try:
        for frame in frames:
            if tracker is None:
                tracker = FrameTracker(scene, frame.image, live=frames.count is None)
                detections.append(tracker.first)
            else:
                detections.append(tracker.see(frame.image))
            times.append(frame.time)
            if watch is not None:
                watch(frame, detections[-1])
    except KeyboardInterrupt:
        if frames.count is not None:
            raise
    if tracker is None:
        raise UserError(f"{frames.name} has no frame")
    pixels = np.stack([frame.markers.centres for frame in detections])
    markers = scene.design.markers
    rest = find_rest_intervals(
        tracker.plane.circles(pixels, scene.design.marker_radius),
        noise=FLOOR[scene.method] / tracker.plane.scales(markers).mean(),
    )
    mean = partial(mean_detections, method=scene.method, lossy=frames.lossy)
    initial, final = (mean([detections[number].markers for number in end]) for end in rest)
    fiducials = _fiducials_at_rest([frame.fiducials for frame in detections], rest)
    before, after, always = map(mean, fiducials)
    motion = None
    if np.isfinite(always.radii).any():
        motion = find_camera_motion(scene, before, after)
        plane = motion.planes[0] if motion.planes else scene.plane(always)
        final = motion.undone(final)
    else:
        plane = scene.plane_from_markers(initial)
    tracking = Tracking(
        design=scene.design,
        expected=markers,
        times=np.array(times),
        pixels=pixels,
        covariances=np.stack([frame.markers.covariances for frame in detections]),
        plane=plane,
        rest=rest,
        initial=initial,
        final=final,
        method=scene.method,
        simulated=frames.simulated or scene.workspace.simulated,
        final_plane=motion.planes[1] if motion and motion.planes else None,
    )
    if motion is None:
        return _oriented_by_motion(scene, replace(tracking, pressed=HAND_HELD))
    if scene.method == "precise":
        tracking = tracking.aligned()
    warnings = [*_warnings(scene, tracking, after, motion)]
    if scene.workspace.simulated and not frames.simulated:
        warnings.append(
            "the workspace is that of a film of pinnray rig, so the displacements count as simulated; for a "
            "film of a real finger give the rig's fiducials.json"
        )
    return replace(tracking, warnings=tuple(warnings))


def _fiducials_at_rest(
    fiducials: Sequence[DiscDetections | None], rest: RestIntervals
) -> tuple[list[DiscDetections], list[DiscDetections], list[DiscDetections]]:
    """Fiducials of the frames at rest in which they were searched for: at the start, at the end, and both.

    If there is no such frame at an end of a live film, the nearest one counts: fiducials do not move with the
    finger. They are always searched for in the first frame.
    """
    searched = [number for number, discs in enumerate(fiducials) if discs is not None]

    def of(end: range, nearest: int) -> list[DiscDetections]:
        numbers = [number for number in searched if number in end] or [nearest]
        return [discs for number in numbers if (discs := fiducials[number]) is not None]

    before, after = of(rest.initial, searched[0]), of(rest.final, searched[-1])
    return before, after, before + after


def _oriented_by_motion(scene: FilmedScene, tracking: Tracking) -> Tracking:
    """A track without fiducials, turned so that the finger is pressed in on its front.

    Raises:
        UserError: If the markers move out of that face and do not look the same from both ends.
    """
    before, after = tracking.rest_positions
    turned = float(np.nanmean((after - before)[:, 1])) > 0
    if turned:
        markers = tracking.expected
        if not np.allclose(2 * markers.mean(axis=0) - markers[::-1], markers):  # by a half turn
            raise UserError(
                "the markers move out of the front: the image is mirrored; flip it, or show fiducials"
            )
        initial, final = (end.where(np.s_[::-1]) for end in (tracking.initial, tracking.final))
        tracking = replace(
            tracking,
            pixels=tracking.pixels[:, ::-1],
            covariances=tracking.covariances[:, ::-1],
            plane=scene.plane_from_markers(initial),
            initial=initial,
            final=final,
        )
    a, b = tracking.plane.parameters[:2]
    accuracy = (
        f"no fiducials: scale and turn are those that put the markers at rest on the design's, "
        f"{tracking.plane.residual:.3f} mm (rms) off; lens and tilt are not undone"
    )
    direction = (
        f"the finger points at {np.degrees(np.arctan2(-b, a)) % 360:.0f} degrees in the image, by its motion"
    )
    return replace(tracking, warnings=(accuracy, direction) if turned else (accuracy,))


def _warnings(
    scene: FilmedScene, tracking: Tracking, after: DiscDetections, motion: CameraMotion
) -> Iterator[str]:
    """Warnings for the user; `after` are the fiducials at the end."""
    residual = tracking.plane.residual
    if scene.camera is None and scene.method == "precise":
        yield f"no camera: its lens is not undone; the fiducials are {residual:.3f} mm (rms) off their places"
        if scene.workspace.marker_plane:
            yield (
                f"no camera: that the markers are {scene.workspace.marker_plane:g} mm nearer to it than the "
                "fiducials is not accounted for: displacements are too large by this share of the camera's "
                "distance; give the camera's file, or lay the fiducials at the markers' height"
            )
    elif scene.camera is not None and scene.camera.covariance is None:
        yield "the camera file has no covariance, so the standard deviations leave the camera's errors out"
    if (hidden := int(np.isnan(after.radii).sum())) > 0:
        yield f"{hidden} of {len(after.radii)} fiducials were not seen"
    remains = motion.remains / tracking.plane.scales(tracking.expected).mean()
    left = f"{remains:.2g} mm, which are in the standard deviations"
    undone = f"which they undo but for {left}" if remains else "which they undo"
    if abs(motion.enlargement) > SCALE:
        size = "larger" if motion.enlargement > 0 else "smaller"
        yield (
            f"the fiducials were {abs(motion.enlargement):.2%} {size} at the end than at the start: the zoom "
            f"changed, or the focus or distance of the camera, {undone}; fix zoom, focus and camera"
        )
    elif motion.shift > SHAKE:
        known = undone if motion.planes else f"and too few of them are seen to undo it: {left}"
        yield (
            f"the fiducials moved by {motion.shift:.2f} pixels between start and end: the camera was not at "
            f"rest, {known}"
        )
    if tracking.visible.any():
        yield from _rest_warnings(scene, tracking)
    if not tracking.visible.all():
        names = ", ".join(str(number + 1) for number in np.nonzero(~tracking.visible)[0])
        yield f"not seen at rest both before and after, so reported missing: marker {names}"


def _rest_warnings(scene: FilmedScene, tracking: Tracking) -> Iterator[str]:
    """Warnings on the markers at rest beside the design's."""
    found = tracking.alignment
    far = float(np.sqrt(np.nanmean((tracking.offsets**2).sum(axis=1)))) if found is None else found.before
    if far > FAR:
        done = "" if found is None else f"; the film was {found}"
        yield f"at rest the markers are {far:.2f} mm (rms) from where the design has them{done}"
    if found is None:
        return
    larger = 1 / (1 + float(found.similarity.values[3])) - 1
    if abs(larger) > max(SCALE, 2 * found.known.scale):
        size = "larger" if larger > 0 else "smaller"
        yield (
            f"lengths between the markers at rest are {abs(larger):.2%} {size} in the film than in the "
            "drawing, and were scaled to it: see at what scale the fiducials were printed, how high the "
            "markers are above them, and whether zoom and focus are those of the calibration; "
            f"{found.after:.2g} mm (rms) remain"
        )
    if found.after > UNLIKE:
        yield (
            f"aligned with the drawing, the markers at rest are still {found.after:.2f} mm (rms) off: they "
            "are not where they are drawn, or the design is another one"
        )
