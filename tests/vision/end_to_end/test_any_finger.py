"""Rig and tracker with fingers that are no wedge: displacements as good as the default finger's."""

from functools import cache

import numpy as np
import pytest

from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.finger.presets import load_design
from pinnray.geometry.mesh.mesher import build_mesh
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.runtime.arrays import FloatArray
from pinnray.vision.rig.bench import Bench
from pinnray.vision.rig.exposure import Exposure
from pinnray.vision.rig.motion import Motion
from pinnray.vision.rig.recording import Recording
from pinnray.vision.rig.shapes import area
from pinnray.vision.rig.virtual_camera import default_camera, viewing_pose
from pinnray.vision.tracking.data_association import (
    NOISE,
    associate_markers,
    distance_from_base,
    step_covariances,
)
from pinnray.vision.tracking.scene import FilmedScene
from pinnray.vision.tracking.tracker import track
from pinnray.vision.tracking.workspace import default_workspace
from tests.fingers import beam, ring
from tests.vision.films import frames_of

FINGERS: dict[str, Finger] = {
    "default": Design(marker_layout="joints"),
    "csiro": load_design("csiro", {"marker_layout": "joints"}),
    "beam": beam(),
    "ring": ring(),
}
FLATTENED = np.array(
    [
        *((-4.10, -3.00), (-3.39, -3.46), (-1.33, -1.57), (-0.66, -7.07), (0.01, -10.04)),
        *((0.68, -7.07), (1.34, -1.58), (3.41, -3.47), (4.11, -3.01)),
    ]
)
"""Displacements of the ring's markers by `fem-nonlinear`, pressed in by 10 mm, shape (9, 2), mm."""
PRESSED_IN = 6.0
"""Largest displacement, mm."""


def squeezed(finger: Finger, points: FloatArray) -> FloatArray:
    """A smooth displacement, zero at the base: a ring is flattened and bulges, others bend; shape (n, 2)."""
    share = (
        distance_from_base(finger.section, points)
        / distance_from_base(finger.section, finger.section.outline.flattened()).max()
    )
    middle = finger.section.bounds.mean(axis=0)[0]
    bulge = 0.5 * np.sin(np.pi * share) * np.tanh((points[:, 0] - middle) / 8) * (finger.name == "ring")
    return PRESSED_IN * np.column_stack([bulge - 0.2 * share**2, -(share**2)])


@cache
def recording(name: str) -> Recording:
    finger, camera = FINGERS[name], default_camera()
    mesh, workspace = build_mesh(finger, MeshSettings(size=1.0)), default_workspace(finger)
    return Recording(
        bench=Bench(mesh, finger, workspace),
        displacement=squeezed(finger, mesh.points),
        camera=camera,
        pose=viewing_pose(camera, workspace, tilt=3.0),
        exposure=Exposure(noise=2),
        motion=Motion(rest=3, moving=1, held=3),
    )


@cache
def error(name: str) -> float:
    """Mean length of the errors of the tracked displacements against those of the discs, mm."""
    film = recording(name)
    scene = FilmedScene(FINGERS[name], film.bench.workspace, camera=film.camera)
    tracking = track(frames_of([image for image, _ in film.frames()]), scene)
    observed = tracking.observations("rig")
    assert observed.visible.all()
    wrong = observed.displacements - film.observations("rig", discs=True).displacements
    return float(np.linalg.norm(wrong, axis=1).mean())


@pytest.mark.release
def test_a_ring_is_tracked_as_accurately_as_the_default_finger() -> None:
    """In proportion to the size of a pixel, about 0.1 mm: hundredths of it."""
    assert error("ring") < max(2 * error("default"), 0.003)


@pytest.mark.parametrize("name", FINGERS)
def test_nothing_lies_on_a_fiducial_and_all_are_in_the_picture(name: str) -> None:
    film = recording(name)
    fiducials = film.bench.workspace.points
    radius = film.bench.workspace.fiducial_diameter / 2
    seen = film.camera.project(np.column_stack([fiducials, np.zeros(len(fiducials))]), film.pose)
    assert ((seen > 0) & (seen < (film.camera.width, film.camera.height))).all()
    shapes = film.bench.scene(film.displacement).shapes[len(fiducials) :]
    for shape in shapes:
        along = shape.edges[:, :1] + np.linspace(0, 1, 9)[:, None] * (shape.edges[:, 1:] - shape.edges[:, :1])
        away = np.linalg.norm(along.reshape(-1, 1, 2) - fiducials, axis=2)
        assert away.min() > radius
    assert all(abs(area(shape.edges)) > 0 for shape in shapes)


def test_markers_on_both_sides_of_a_ring_keep_their_names_though_they_are_equally_far_from_the_base() -> None:
    finger = ring()
    points = finger.markers
    reach = distance_from_base(finger.section, points)
    fields = step_covariances(points, reach)
    for field in fields.reshape(-1, len(points), len(points)):
        assert np.linalg.eigvalsh(field + NOISE**2 * np.eye(len(points))).min() > NOISE**2 / 2
    generator = np.random.default_rng(3)
    named = 0
    for _ in range(100):
        start = points + generator.uniform(0, 0.3) * FLATTENED
        step = generator.uniform(0, 0.7) * FLATTENED + generator.normal(0, 0.01, points.shape)
        order = generator.permutation(len(points))
        names = associate_markers((start + step)[order], start, fields)
        assert ((names < 0) | (order[names] == np.arange(len(points)))).all()  # missing rather than swapped
        named += int((names >= 0).sum())
    assert named > 0.93 * 100 * len(points)
