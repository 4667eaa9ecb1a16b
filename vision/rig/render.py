"""Rendering of a scene through a camera."""

from collections.abc import Sequence

import cv2
import numpy as np

from vision.calibration.camera import Camera, Pose
from vision.frames.frame import Image
from vision.rig.exposure import Exposure, Light
from vision.rig.pixel_coverage import pixel_coverage
from vision.rig.shapes import Scene, seen_edges


def render(
    scene: Scene, camera: Camera, pose: Pose, exposure: Exposure, *, seed: int = 0, frame: int = 0
) -> Image:
    """Render a scene; the same arguments give the same image to the bit.

    Args:
        scene: The shapes.
        camera: The camera.
        pose: Of the scene's frame in the camera's.
        exposure: Light, lens and sensor.
        seed: Of the noise of a recording.
        frame: Its number in the recording; noise is independent between frames.

    Returns:
        Shape (height, width, 3), BGR, or (height, width) if the exposure is monochrome.
    """
    light = light_of(scene, camera, pose, exposure.blur)
    return exposure.develop(light, noise_of(seed, frame))


def noise_of(seed: int, frame: int) -> np.random.Generator:
    """Random generator of one frame of a recording."""
    return np.random.default_rng([seed, frame])


def light_of(scene: Scene, camera: Camera, pose: Pose, blur: float) -> Light:
    """The light of a scene on the pixels: its integral over each, through a lens with this blur, pixels."""
    return mean_light([scene], camera, pose, blur)


def mean_light(scenes: Sequence[Scene], camera: Camera, pose: Pose, blur: float) -> Light:
    """The mean light of scenes, as of a finger that moves while the shutter is open; see `light_of`."""
    cells = fineness(blur)
    size = (camera.width * cells, camera.height * cells)
    canvas = _painted(scenes[0], camera, pose, cells, size)
    for scene in scenes[1:]:
        canvas += _painted(scene, camera, pose, cells, size)
    canvas /= len(scenes)
    return _on_pixels(canvas, blur, cells)


def fineness(blur: float) -> int:
    """Cells along a side of a pixel, enough to resolve the blur."""
    return int(np.clip(np.ceil(2 / blur), 2, 4)) if blur else 1


def _painted(scene: Scene, camera: Camera, pose: Pose, cells: int, size: tuple[int, int]) -> Light:
    """The light of a scene on the cells of a grid of this width and height."""
    canvas = np.full((*size[::-1], 3), scene.background, dtype=np.float32)
    for shape in scene.shapes:
        rows, columns, share = pixel_coverage((seen_edges(shape, camera, pose) + 0.5) * cells, size)
        below = canvas[rows, columns]
        below += share[:, :, None].astype(np.float32) * (np.array(shape.colour, dtype=np.float32) - below)
    return canvas


def _on_pixels(canvas: Light, blur: float, cells: int) -> Light:
    """Blurred light on pixels from that on their cells, `cells`² for each pixel."""
    if not blur:
        return canvas
    reach = 2 * int(np.ceil(4 * blur * cells)) + 1
    soft = cv2.GaussianBlur(canvas, (reach, reach), blur * cells, borderType=cv2.BORDER_REPLICATE)
    size = (canvas.shape[1] // cells, canvas.shape[0] // cells)
    return np.asarray(cv2.resize(soft, size, interpolation=cv2.INTER_AREA), dtype=np.float32)
