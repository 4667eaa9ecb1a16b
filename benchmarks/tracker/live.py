"""Tracking speed, frames a second at 1280x720 pixels, once the markers are locked.

A film of the virtual rig is played to and fro, so that markers move by some 5 pixels between frames. Frames
in memory time the tracker alone; the same frames from videos time it with the decoder. About a minute,
mostly for the rig.
"""

import time
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
from rich.table import Table

from compare.runtime.tables import terminal_table
from geometry.cache import finger_mesh
from geometry.finger.design import Design
from geometry.mesh.settings import MeshSettings
from vision.discs.disc_detector import METHODS
from vision.frames.frame import Image
from vision.frames.sources import open_frames
from vision.frames.video import video_writer
from vision.rig.bench import Bench
from vision.rig.exposure import Exposure
from vision.rig.motion import Motion
from vision.rig.recording import Recording
from vision.rig.virtual_camera import default_camera, viewing_pose
from vision.tracking.frame_tracker import FrameTracker
from vision.tracking.scene import FilmedScene
from vision.tracking.workspace import default_workspace

FRAMES = 240


def main() -> Table:
    """Render, then track."""
    scene, images = film()
    to_and_fro = [*images, *images[-2:0:-1]]
    whole = [to_and_fro[number % len(to_and_fro)] for number in range(FRAMES)]
    grey = [cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in whole]
    rows = []
    with TemporaryDirectory() as folder:
        sources: dict[str, Path] = {}
        for name, suffix in (("MJPG", ".avi"), ("mp4v", ".mp4"), ("FFV1", ".mkv")):
            sources[name] = Path(folder) / f"film{suffix}"
            with video_writer(sources[name], (1280, 720), 60.0) as write:
                for image in whole:
                    write(image)
        for method in METHODS:
            known = FilmedScene(scene.design, scene.workspace, scene.camera, method=method)
            rows.append((method, "memory, coloured", *_timed(known, whole)))
            rows.append((method, "memory, grey", *_timed(known, grey)))
            for name, path in sources.items():
                with open_frames(path) as frames:
                    timed = _timed(known, (frame.image for frame in frames))
                rows.append((method, f"{name} video", *timed))
    title = "Tracking at 1280x720 pixels, nine markers and seven fiducials"
    header = ("method", "frames from", "frames a second", "median, ms", "95 %, ms", "lost markers")
    return terminal_table(title, header, rows, left=header[:2])


def film() -> tuple[FilmedScene, list[Image]]:
    """A finger that is bent by 10 mm in 24 frames."""
    design, camera = Design(), default_camera()
    workspace = default_workspace(design)
    mesh = finger_mesh(design, settings=MeshSettings(size=1.0))
    x = mesh.points[:, 0] / design.height
    recording = Recording(
        bench=Bench(mesh, design, workspace),
        displacement=-10 * np.column_stack([0.2 * x**2, x**2]),
        camera=camera,
        pose=viewing_pose(camera, workspace, tilt=3),
        exposure=Exposure(noise=2),
        motion=Motion(rest=1, moving=22, held=1, shutter=0),
    )
    return FilmedScene(design, workspace, camera), [image for image, _ in recording.frames()]


def _timed(scene: FilmedScene, images: Iterable[Image]) -> tuple[str, ...]:
    """Cells of a row; the first frame, in which the markers are found, does not count."""
    tracker, spent, lost = None, [], 0
    before = time.perf_counter()
    for image in images:
        if tracker is None:
            tracker = FrameTracker(scene, image, live=True)
        else:
            lost += int(np.isnan(tracker.see(image).markers.radii).sum())
            spent.append(time.perf_counter() - before)
        before = time.perf_counter()
    times = 1000 * np.array(spent)
    return (
        f"{1000 / times.mean():.0f}",
        f"{np.median(times):.1f}",
        f"{np.percentile(times, 95):.1f}",
        str(lost),
    )
