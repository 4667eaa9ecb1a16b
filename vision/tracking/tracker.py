"""From frames to the markers' displacements."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from geometry.errors import UserError
from geometry.finger.markers import marker_positions
from vision.discs.disc_detector import FLOOR, Spots
from vision.frames.frame import Frame, Frames
from vision.tracking.camera_motion import Shake, find_shake
from vision.tracking.frame_tracker import Follower, Sighting
from vision.tracking.plane_without_fiducials import symmetric
from vision.tracking.rest_detection import find_rest
from vision.tracking.scene import Fiducials, Setup, check_size
from vision.tracking.trajectories import Tracking, mean_spots, placed

FAR = 0.5
"""Root mean square distance of the markers at rest from the design's, mm, that is worth a word."""
SHAKE = 0.3
"""Way of the fiducials between start and end that is worth a word, pixels."""


def ignore(frame: Frame, sighting: Sighting) -> None:
    """Watch nothing."""


def track(frames: Frames, setup: Setup, watch: Callable[[Frame, Sighting], None] = ignore) -> Tracking:
    """Track the markers through a video.

    The plane comes from the fiducials in all frames at rest; the displacements are those of the markers'
    means over the frames at rest, from before to after the motion; if the camera moved between them, the
    fiducials undo it. What has no end of its own, a camera or a pipe, is ended by an interrupt from the
    keyboard.

    Args:
        frames: From the finger at rest until it is held.
        setup: What they show.
        watch: Is told what every frame shows, while it is tracked.

    Raises:
        UserError: If the frames do not show what they should; one line says what is amiss.
    """
    check_size(setup.camera, frames.size, frames.name)
    times: list[float] = []
    sightings: list[Sighting] = []
    follower = None
    try:
        for frame in frames:
            if follower is None:
                follower = Follower(setup, frame.image, live=frames.count is None)
                sighting = follower.first
            else:
                sighting = follower.see(frame.image)
            times.append(frame.time)
            sightings.append(sighting)
            watch(frame, sighting)
    except KeyboardInterrupt:
        if frames.count is not None:
            raise
    if follower is None:
        raise UserError(f"{frames.name} has no frame")
    pixels = np.stack([sighting.markers.centres for sighting in sightings])
    positions = placed(follower.plane, pixels, setup.design)
    scale = follower.plane.scales(marker_positions(setup.design)).mean()
    rest = find_rest(positions, noise=FLOOR[setup.method] / scale)
    still = [[sightings[number] for number in end] for end in rest]
    initial, final = (mean_spots([s.markers for s in end], setup.method) for end in still)
    anchors = [mean_spots([s.fiducials for s in end], setup.method) for end in (*still, still[0] + still[1])]
    numbers = np.nonzero(np.isfinite(anchors[2].radii))[0]
    alone = not len(numbers)
    if alone:
        plane = setup.alone_plane(initial.centres, initial.covariances)
    else:
        shake = find_shake(setup, anchors[0], anchors[1])
        plane = (
            shake.planes[0] if shake.planes else setup.plane(Fiducials(numbers, anchors[2].where(numbers)))
        )
        final = shake.undone(final)
    tracking = Tracking(
        design=setup.design,
        expected=marker_positions(setup.design),
        times=np.array(times),
        pixels=pixels,
        covariances=np.stack([sighting.markers.covariances for sighting in sightings]),
        plane=plane,
        rest=rest,
        initial=initial,
        final=final,
        method=setup.method,
    )
    if alone:
        return _by_the_motion(setup, tracking)
    return replace(tracking, warnings=tuple(_remarks(setup, tracking, anchors[1], shake)))


def _by_the_motion(setup: Setup, tracking: Tracking) -> Tracking:
    """What was tracked without fiducials, the right way round: a finger is pressed in on its front face.

    Raises:
        UserError: If the markers move out of that face and do not look the same from both ends.
    """
    turned = _pressed(tracking) > 0
    if turned:
        if not symmetric(tracking.expected):
            raise UserError(
                "the markers move out of the front face: the image is mirrored; flip it, or show fiducials"
            )
        initial, final = (Spots(*(part[::-1] for part in end)) for end in (tracking.initial, tracking.final))
        tracking = replace(
            tracking,
            pixels=tracking.pixels[:, ::-1],
            covariances=tracking.covariances[:, ::-1],
            plane=setup.alone_plane(initial.centres, initial.covariances),
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
        placed(tracking.plane, end.centres, tracking.design) for end in (tracking.initial, tracking.final)
    )
    return float(np.nanmean((after - before)[:, 1]))


def _remarks(setup: Setup, tracking: Tracking, after: Spots, shake: Shake) -> Iterator[str]:
    """What a person should know; `after` are the fiducials."""
    residual = tracking.plane.residual
    if setup.camera is None and setup.method == "precise":
        yield f"no camera: its lens is not undone; the fiducials are {residual:.3f} mm (rms) off their places"
        if setup.workspace.marker_plane:
            yield "no camera: the height of the markers above the fiducials is not accounted for"
    elif setup.camera is not None and setup.camera.covariance is None:
        yield "the camera file has no covariance, so the standard deviations leave the camera's errors out"
    if (hidden := int(np.isnan(after.radii).sum())) > 0:
        yield f"{hidden} of {len(after.radii)} fiducials were not seen"
    if shake.way > SHAKE:
        known = "which they undo" if shake.planes else "and too few of them are seen to undo it"
        yield (
            f"the fiducials moved by {shake.way:.2f} pixels between start and end: the camera was not at "
            f"rest, {known}"
        )
    far = float(np.sqrt(np.nanmean((tracking.offsets**2).sum(axis=1))))
    if far > FAR:
        yield f"at rest the markers are {far:.2f} mm (rms) from where the design has them"
    if not tracking.visible.all():
        names = ", ".join(str(number + 1) for number in np.nonzero(~tracking.visible)[0])
        yield f"not seen at rest both before and after, so reported missing: marker {names}"
