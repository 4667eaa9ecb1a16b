"""Files of a recording: the video, the truth, and the inputs of a tracker."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from pinnray.runtime.atomic import write_json, write_text
from pinnray.runtime.errors import UserError
from pinnray.runtime.progress import Progress, silent
from pinnray.runtime.tables import Cell, write_csv
from pinnray.vision.calibration.camera import Pose
from pinnray.vision.calibration.camera_file import save_camera
from pinnray.vision.frames.frame import RIG_MARK, Image
from pinnray.vision.frames.pictures import write_picture
from pinnray.vision.frames.video import CODECS, video_writer
from pinnray.vision.measurements import write_measurements
from pinnray.vision.rig.recording import Recording
from pinnray.vision.rig.render import render
from pinnray.vision.rig.shapes import Scene
from pinnray.vision.tracking.workspace import workspace_svg

PICTURES = "png"
FILES = {codec.lower(): f"video{suffix}" for suffix, (codec, *_) in CODECS.items()} | {PICTURES: "frames"}
"""File or folder of the frames by codec."""
TRUTH_COLUMNS = (
    *("frame", "time_s", "load", "marker"),
    *("x_mm", "y_mm", "z_mm", "x_px", "y_px", "x_disc_mm", "y_disc_mm", "seen"),
)


def record(
    recording: Recording, folder: Path, *, source: str, codec: str = "ffv1", progress: Progress = silent
) -> None:
    """Write a recording into a folder that exists.

    The frames (`FILES` by the codec); `truth.csv` with every marker in every frame; the true displacements of
    the markers' centres, `observations_true.csv`, and of their discs' middles, `observations_discs.csv`;
    `camera.json`, `workspace.json`; `fiducials.svg` to print and their places, `fiducials.json`; `truth.json`
    with the rest of the settings. Frames, photographs and `workspace.json` are marked as simulated.

    Args:
        recording: The film.
        folder: Where the files go.
        source: Origin of the displacements, one sentence.
        codec: ffv1 and png lose nothing; mjpg and mp4v do.
        progress: Called with the share that is done and a text.

    Raises:
        UserError: If the codec is unknown or a file cannot be written.
    """
    check_codec(codec)
    count, rate = len(recording.motion), recording.motion.rate
    rows: list[dict[str, Cell | None]] = []
    with _writer(recording, folder / FILES[codec]) as write:
        for number, (image, truth) in enumerate(recording.frames()):
            write(image)
            markers = np.column_stack([truth.world, truth.pixels, truth.discs, truth.seen]).tolist()
            for marker, values in enumerate(markers, start=1):
                cells = (number, number / rate, truth.load, marker, *values)
                rows.append(dict(zip(TRUTH_COLUMNS, cells, strict=True)))
            progress((number + 1) / count, f"{number + 1} of {count} frames")
    write_csv(folder / "truth.csv", rows)
    write_measurements(folder / "observations_true.csv", recording.observations(source))
    of_discs = recording.observations(f"{source}; middles of the markers' discs", discs=True)
    write_measurements(folder / "observations_discs.csv", of_discs)
    save_camera(folder / "camera.json", recording.camera)
    bench = recording.bench
    for name, simulated in (("workspace.json", True), ("fiducials.json", False)):
        workspace = bench.workspace.model_copy(update={"simulated": simulated})
        write_json(folder / name, workspace.model_dump(mode="json"))
    write_text(folder / "fiducials.svg", workspace_svg(bench.workspace, bench.finger))
    rotation, translation = recording.pose
    settings = {
        "design": bench.finger.definition(),
        "mesh_sha256": bench.mesh.digest,
        "paint": bench.paint,
        "irregular": bench.irregular,
        "pose": {"rotation": rotation.tolist(), "translation_mm": translation.tolist()},
        "exposure": recording.exposure.model_dump(),
        "motion": recording.motion.model_dump(),
        "seed": recording.seed,
    }
    write_json(folder / "truth.json", settings)


def check_codec(codec: str) -> None:
    """Raise `UserError` unless there is such a codec."""
    if codec not in FILES:
        raise UserError(f"there is no codec {codec!r}; there are {', '.join(FILES)}")


def photograph(
    scene: Scene, poses: Sequence[Pose], recording: Recording, folder: Path, *, progress: Progress = silent
) -> None:
    """Photograph a scene in some poses with the camera of a recording, as PNG pictures in a new folder.

    Their frame numbers, and so their noise, follow those of the recording.
    """
    folder.mkdir()
    first = len(recording.motion)
    for number, pose in enumerate(poses):
        place = {"seed": recording.seed, "frame": first + number}
        image = render(scene, recording.camera, pose, recording.exposure, **place)
        write_picture(folder / f"{number:03d}.png", image, comment=RIG_MARK)
        progress((number + 1) / len(poses), f"{number + 1} of {len(poses)} photographs")


@contextmanager
def _writer(recording: Recording, place: Path) -> Iterator[Callable[[Image], None]]:
    """A function that appends a frame to the video or to the folder of pictures."""
    if place.suffix:
        size = (recording.camera.width, recording.camera.height)
        with video_writer(place, size, recording.motion.rate, comment=RIG_MARK) as write:
            yield write
    else:
        place.mkdir()
        names = (place / f"{number:06d}.png" for number in range(len(recording.motion)))
        yield lambda image: write_picture(next(names), image, comment=RIG_MARK)
