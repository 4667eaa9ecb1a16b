"""Short films of the default finger: at rest, then bent by a cantilever's deflection, 10 mm at the tip."""

from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any

import numpy as np

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.observations import Observations
from pinnray.runtime.arrays import FloatArray
from pinnray.vision.frames.frame import CapturedImage, Frames, Image
from pinnray.vision.rig.bench import Bench
from pinnray.vision.rig.exposure import Exposure
from pinnray.vision.rig.motion import Motion
from pinnray.vision.rig.recording import Recording
from pinnray.vision.rig.virtual_camera import default_camera, viewing_pose
from pinnray.vision.tracking.scene import FilmedScene
from pinnray.vision.tracking.tracker import track
from pinnray.vision.tracking.trajectories import Tracking
from pinnray.vision.tracking.workspace import default_workspace

DESIGN = Design()
WORKSPACE = default_workspace(DESIGN)
CAMERA = default_camera()


def bent(points: FloatArray) -> FloatArray:
    """Displacements of points, shape (n, 2), mm."""
    x = points[:, 0] / DESIGN.height
    return np.asarray(-10 * np.column_stack([0.2 * x**2, x**2]))


@cache
def recording(*, design: Design = DESIGN) -> Recording:
    """Three frames at rest and three bent, with a jump between."""
    mesh = finger_mesh(design, settings=MeshSettings(size=1.0), across=3)
    return Recording(
        bench=Bench(mesh, design, WORKSPACE),
        displacement=bent(mesh.points),
        camera=CAMERA,
        pose=viewing_pose(CAMERA, WORKSPACE, tilt=5.0),
        exposure=Exposure(noise=2),
        motion=Motion(rest=3, moving=0, held=3),
    )


@cache
def images(*, design: Design = DESIGN) -> tuple[Image, ...]:
    """The frames of `recording`."""
    return tuple(image for image, _ in recording(design=design).frames())


def frames_of(pictures: Sequence[Image], *, live: bool = False) -> Frames:
    """Images as a film, or as those of a camera."""

    def shots() -> Iterator[CapturedImage]:
        for number, picture in enumerate(pictures):
            yield CapturedImage(np.ascontiguousarray(picture), number / 30, f"picture {number}")

    return Frames("the film", shots(), rate=30.0, count=None if live else len(pictures))


def tracked(pictures: Sequence[Image], **changes: Any) -> Tracking:
    """Images, tracked in the scene of this module, which may be changed."""
    scene: dict[str, Any] = {"design": DESIGN, "workspace": WORKSPACE, "camera": CAMERA}
    return track(frames_of(pictures), FilmedScene(**scene | changes))


def error_of(observations: Observations, true: FloatArray | None = None) -> float:
    """Mean over the markers of the sum of the absolute errors, mm; by default `DESIGN` is true."""
    true = bent(DESIGN.markers) if true is None else true
    return float(np.abs(observations.displacements - true)[observations.visible].sum(axis=1).mean())
