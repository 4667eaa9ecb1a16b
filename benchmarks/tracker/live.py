"""Tracking speed, frames a second at 1280x720 pixels, once the markers are locked.

A film of the virtual rig in memory is played to and fro, so that markers move by some 5 pixels a frame.
About a minute, mostly for the rig.
"""

import time
from collections.abc import Sequence

import cv2
import numpy as np
from rich.table import Table

from compare.runtime.tables import terminal_table
from geometry.cache import finger_mesh
from geometry.finger.design import Design
from geometry.mesh.settings import MeshSettings
from vision.discs.disc_detector import METHODS
from vision.frames.frame import Image
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
    films = {"coloured": whole, "grey": [cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in whole]}
    rows = [
        (
            method,
            name,
            *_timed(FilmedScene(scene.design, scene.workspace, scene.camera, method=method), frames),
        )
        for method in METHODS
        for name, frames in films.items()
    ]
    title = "Tracking at 1280x720 pixels, nine markers and seven fiducials"
    header = ("method", "frames", "frames a second", "median, ms", "95 %, ms", "lost markers")
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


def _timed(scene: FilmedScene, images: Sequence[Image]) -> tuple[str, ...]:
    """Cells of a row; the first frame, in which the markers are found, does not count."""
    tracker, times, lost = FrameTracker(scene, images[0], live=True), [], 0
    for image in images[1:]:
        before = time.perf_counter()
        lost += int(np.isnan(tracker.see(image).markers.radii).sum())
        times.append(1000 * (time.perf_counter() - before))
    median, most = np.median(times), np.percentile(times, 95)
    return f"{1000 / np.mean(times):.0f}", f"{median:.1f}", f"{most:.1f}", str(lost)
