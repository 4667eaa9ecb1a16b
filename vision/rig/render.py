"""Rendering of a scene through a camera, by the exact share of every pixel that a polygon covers.

An edge that rises by dy within a pixel adds dy to the coverage of the pixels to its right in that row, and to
its own pixel the part of dy to its right; cumulative sums along the rows give the area, without sampling.
Source: R. Levien, "Inside the fastest font renderer in the world", 2016.
"""

from collections.abc import Callable, Sequence

import cv2
import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.vision.calibration.camera import Camera, Pose
from pinnray.vision.frames.frame import Image
from pinnray.vision.rig.exposure import Exposure, Light
from pinnray.vision.rig.shapes import Scene, Shape, area, seen_edges


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
    light = mean_light([scene], camera, pose, exposure.blur, exposure.lamp)
    return exposure.develop(light, noise_of(seed, frame))


def noise_of(seed: int, frame: int) -> np.random.Generator:
    """Random generator of one frame of a recording."""
    return np.random.default_rng([seed, frame])


def mean_light(
    scenes: Sequence[Scene],
    camera: Camera,
    pose: Pose,
    blur: float,
    lamp: Callable[[tuple[int, int]], Light] | None = None,
) -> Light:
    """The mean light of scenes on the pixels: its integral over each, through a lens with this blur, pixels.

    Several scenes are a finger that moves while the shutter is open. A lamp lights the scenes; it gives its
    light on a grid of so many columns and rows over the picture.
    """
    cells = int(np.clip(np.ceil(2 / blur), 2, 4)) if blur else 1  # along a side of a pixel
    size = (camera.width * cells, camera.height * cells)
    canvas = _painted(scenes[0], camera, pose, cells, size)
    for scene in scenes[1:]:
        canvas += _painted(scene, camera, pose, cells, size)
    canvas /= len(scenes)
    if lamp is not None:
        canvas *= lamp(size)[:, :, None]
    return _on_pixels(canvas, blur, cells)


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


def pixel_coverage(edges: FloatArray, size: tuple[int, int]) -> tuple[slice, slice, FloatArray]:
    """Share of every cell of a grid that closed polygons cover.

    Args:
        edges: Starts and ends, shape (n, 2, 2), in any order; cell (0, 0) goes from (0, 0) to (1, 1).
            The body lies on the same side of all, so holes run the other way round.
        size: Columns and rows of the grid.

    Returns:
        Rows and columns of the polygons' bounding box, and the coverage there, shape (rows, columns);
        elsewhere it is zero.
    """
    ends = edges.reshape(-1, 2)
    low = np.clip(np.floor(ends.min(axis=0, initial=np.inf)), 0, size).astype(np.int64)
    high = np.clip(np.ceil(ends.max(axis=0, initial=0)), low, size).astype(np.int64)
    (left, top), (width, height) = low, high - low
    start, end = _pieces(edges - low)
    middle, rise = (start + end) / 2, end[:, 1] - start[:, 1]
    column, row = np.floor(middle).astype(np.int64).T
    seen = (row >= 0) & (row < height) & (column < width)
    before = np.where(column < 0, 0.0, middle[:, 0] - column)[seen]
    place = (row * (width + 1) + np.maximum(column, 0))[seen]
    steps = np.zeros(height * (width + 1) + 1)
    steps += np.bincount(place, rise[seen] * (1 - before), minlength=len(steps))
    steps += np.bincount(place + 1, rise[seen] * before, minlength=len(steps))
    share = np.abs(np.cumsum(steps[:-1].reshape(height, width + 1), axis=1)[:, :width])
    return slice(top, top + height), slice(left, left + width), np.minimum(share, 1.0)


def share_seen(shape: Shape, occluders: Sequence[Shape], camera: Camera, pose: Pose) -> float:
    """Share of a shape's image that is visible: inside the frame and not occluded, to a hundredth."""
    size = (camera.width, camera.height)
    edges = seen_edges(shape, camera, pose) + 0.5
    whole = abs(area(edges))
    rows, columns, left = pixel_coverage(edges, size)
    for occluder in occluders:
        hidden = np.zeros_like(left)
        beside = seen_edges(occluder, camera, pose) + 0.5 - (columns.start, rows.start)
        across, along, share = pixel_coverage(beside, (hidden.shape[1], hidden.shape[0]))
        hidden[across, along] = share
        left = left * (1 - hidden)
    return float(left.sum() / whole)


def _pieces(edges: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The edges cut where they cross from one cell to the next: starts and ends, shapes (m, 2)."""
    start, step = edges[:, 0], edges[:, 1] - edges[:, 0]
    every = np.arange(len(edges))
    edge, where = [every], [np.zeros(len(edges))]
    for axis in range(2):
        first = np.floor(edges[:, :, axis].min(axis=1)) + 1
        count = np.maximum(np.ceil(edges[:, :, axis].max(axis=1)) - first, 0).astype(np.int64)
        crossing = np.repeat(every, count)
        nth = np.arange(len(crossing)) - np.repeat(np.cumsum(count) - count, count)
        edge.append(crossing)
        where.append((first[crossing] + nth - start[crossing, axis]) / step[crossing, axis])
    owner, along = np.concatenate(edge), np.concatenate(where)
    order = np.lexsort((along, owner))
    owner, along = owner[order], along[order]
    cut = start[owner] + along[:, None] * step[owner]
    last = np.append(owner[1:] != owner[:-1], True)[: len(owner)]
    after = np.roll(cut, -1, axis=0)
    after[last] = edges[owner[last], 1]
    return cut, after
