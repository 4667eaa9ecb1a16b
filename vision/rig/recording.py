"""A recording of the finger: its frames, each with its truth."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import NamedTuple

import numpy as np

from pinnray.geometry.observations import Observations
from pinnray.runtime.arrays import FloatArray
from pinnray.vision.calibration.camera import Camera, Pose
from pinnray.vision.frames.frame import Image
from pinnray.vision.rig.bench import Bench
from pinnray.vision.rig.exposure import Exposure, Light
from pinnray.vision.rig.motion import Motion
from pinnray.vision.rig.render import mean_light, noise_of, share_seen
from pinnray.vision.rig.shapes import Shape, centroid

STEP = 1.0
"""Longest step between the instants whose mean is an image with motion blur, pixels."""
MOST_STEPS = 32


class FrameTruth(NamedTuple):
    """Truth about a frame.

    Attributes:
        load: Mean share of the load while the shutter is open.
        world: Mean of the markers' centres while the shutter is open, shape (m, 3), mm.
        pixels: The same in the image, shape (m, 2).
        discs: Centroids of the deformed discs, shape (m, 2), mm, which a camera sees; they differ from the
            centres in a finger that bends.
        seen: Visible share of every marker's image, shape (m,).
    """

    load: float
    world: FloatArray
    pixels: FloatArray
    discs: FloatArray
    seen: FloatArray


@dataclass(frozen=True, eq=False)
class Recording:
    """Settings of a film; `frames` renders it.

    Attributes:
        bench: The finger and what is around it.
        displacement: Of the mesh's nodes under the whole load, shape (n, 2), mm.
        camera, pose, exposure, motion: Of the film.
        occluders: Shapes in front of the finger in a frame.
        seed: Of the noise.
        course: Displacements, shape (n, 2), mm, by the share of the load; None: in proportion to it.
    """

    bench: Bench
    displacement: FloatArray
    camera: Camera
    pose: Pose
    exposure: Exposure = Exposure()
    motion: Motion = Motion()
    occluders: Callable[[int], Sequence[Shape]] = lambda frame: ()
    seed: int = 0
    course: Callable[[float], FloatArray] | None = None

    def displaced(self, load: float) -> FloatArray:
        """Displacement of the mesh's nodes under a share of the load, shape (n, 2), mm."""
        return load * self.displacement if self.course is None else np.asarray(self.course(load))

    def load(self, number: int) -> float:
        """Mean share of the load while a frame is exposed."""
        return float(np.mean(self._state(number)[0]))

    def frames(self) -> Iterator[tuple[Image, FrameTruth]]:
        """The frames in order, each with its truth."""
        for state, numbers in groupby(range(len(self.motion)), key=self._state):
            light, truth = self._seen(*state)
            for number in numbers:
                yield self.exposure.develop(light, noise_of(self.seed, number)), truth

    def frame(self, number: int) -> tuple[Image, FrameTruth]:
        """One frame, the same as among all."""
        light, truth = self._seen(*self._state(number))
        return self.exposure.develop(light, noise_of(self.seed, number)), truth

    def observations(self, source: str, *, discs: bool = False) -> Observations:
        """The true displacements of the markers between rest and whole load.

        Args:
            source: One sentence on where they come from.
            discs: Whether of the centroids of their discs, which a camera sees, or of their centres.
        """
        mesh = self.bench.mesh
        moved = self.displacement[mesh.marker_nodes]
        if discs:
            moved = self._middles(self.displacement) - self._middles(np.zeros_like(self.displacement))
        radius = self.bench.finger.marker_radius
        return Observations(mesh.markers, moved, source=source, simulated=True, marker_radius=radius)

    def _middles(self, displacement: FloatArray) -> FloatArray:
        """Centroids of the markers' discs, shape (m, 2), mm."""
        return np.array([centroid(disc.edges) for disc in self.bench.discs(displacement)])

    def _state(self, number: int) -> tuple[tuple[float, ...], tuple[Shape, ...]]:
        """Shares of the load in a frame's exposure, and the occluders."""
        pictures = np.ceil(self.motion.travel(number) * self._path / STEP)
        loads = self.motion.exposed(number, int(np.clip(pictures, 1, MOST_STEPS)))
        return tuple(loads.tolist()), tuple(self.occluders(number))

    @cached_property
    def _path(self) -> float:
        """The longest displacement of a marker in the image, pixels."""
        marks = (self.bench.markers(self.displaced(load)) for load in (0, 1))
        start, end = (self.camera.project(each, self.pose) for each in marks)
        return float(np.linalg.norm(end - start, axis=1).max())

    def _seen(self, loads: Sequence[float], occluders: Sequence[Shape]) -> tuple[Light, FrameTruth]:
        """Mean light of the states with these shares of the load, and their truth."""
        states = [self.displaced(load) for load in loads]
        scenes = [self.bench.scene(state, occluders) for state in states]
        light = mean_light(scenes, self.camera, self.pose, self.exposure.blur, self.exposure.lamp)
        worlds = [self.bench.markers(state) for state in states]
        discs = self.bench.discs(states[len(states) // 2])
        truth = FrameTruth(
            load=float(np.mean(loads)),
            world=np.mean(worlds, axis=0),
            pixels=np.mean([self.camera.project(world, self.pose) for world in worlds], axis=0),
            discs=np.mean([self._middles(state) for state in states], axis=0),
            seen=np.array([share_seen(disc, occluders, self.camera, self.pose) for disc in discs]),
        )
        return light, truth
