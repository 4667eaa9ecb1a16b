"""Proposals: all markers, under bad light, at every size."""

import numpy as np
import pytest

from pinnray.geometry.finger.design import Design
from pinnray.runtime.arrays import FloatArray
from pinnray.vision.discs.circle_proposals import highlight_colour, propose_circles
from pinnray.vision.discs.colour import DARK, ColourRange
from pinnray.vision.rig.bench import Bench
from pinnray.vision.rig.exposure import Exposure
from pinnray.vision.rig.render import render
from pinnray.vision.rig.virtual_camera import default_camera, viewing_pose
from pinnray.vision.tracking.workspace import default_workspace
from tests.vision.discs.dots import Dots, dots, draw_disc, exposed, step

GREY = np.full((200, 300), 128, np.uint8)


def missed(scene: Dots, found: FloatArray) -> int:
    """How many discs have no proposal within 2 pixels of the centre and of the radius."""
    apart = (
        np.abs(found[:, None] - scene.discs).max(axis=2) if len(found) else np.full((1, len(scene.discs)), 9)
    )
    return int((apart.min(axis=0) > 2).sum())


@pytest.mark.parametrize(
    ("radius", "other", "grey"),
    [
        (4.0, {}, False),
        (7.6, {}, True),
        (25.0, {}, True),
        (7.6, {"wall": 180.0, "background": 225.0}, False),  # the wall is darker than what is around it
        (7.6, {"noise": 0.0, "blur": 0.5, "shading": 0.0}, False),
    ],
)
def test_every_disc_is_proposed(radius, other, grey):
    """Noise 6, blur 1.5, shading 30 % if not said otherwise; sixteen discs."""
    scene = dots(radius, **other)
    image = scene.image[:, :, 1] if grey else scene.image
    found = propose_circles(image, radii=(0.7 * radius, 1.3 * min(2.5 * radius, 25)))
    assert missed(scene, found) == 0
    assert len(found) < 45
    if radius > 5:
        error = np.abs(found[:, None, :2] - scene.discs[:, :2]).max(axis=2).min(axis=0)
        assert np.sqrt(np.mean(error**2)) < 0.8


def test_coloured_discs_are_proposed_alone():
    """Red ones by their colour: not the seven dark ones."""
    scene = dots(7.6, colour=(40, 40, 200))
    found = propose_circles(scene.image, ColourRange((20, 25, 5), (80, 90, 80)), radii=(5, 11))
    assert missed(Dots(scene.image, scene.discs[:9]), found) == 0
    assert len(found) == 9


@pytest.mark.parametrize("paint", ["dark", "blue"])
@pytest.mark.parametrize("monochrome", [False, True])
def test_all_markers_and_fiducials_of_the_rig_are_proposed(paint, monochrome, coarse_mesh):
    """A pressed finger seen under 5 degrees, in bad light: nearly nothing else is proposed."""
    workspace, camera = default_workspace(Design()), default_camera()
    bench = Bench(coarse_mesh, Design(), workspace, paint=paint)
    x = coarse_mesh.points[:, 0] / 90
    pressed = -10 * np.column_stack([0.2 * x**2, x**2])
    pose = viewing_pose(camera, workspace, tilt=5.0)
    exposure = Exposure(noise=6, blur=1.5, gradient=0.3, monochrome=monochrome)
    image = render(bench.scene(pressed), camera, pose, exposure)
    fiducials = np.column_stack([workspace.points, np.zeros(7)])
    for points, radius in ((bench.markers(pressed), 7.6), (fiducials, 19.0)):  # pixels
        found = propose_circles(image, radii=(0.7 * radius, 1.3 * radius))
        apart = np.linalg.norm(found[:, None, :2] - camera.project(points, pose), axis=2)
        assert apart.min(axis=0).max() < 3
        assert len(found) <= len(points) + 3


@pytest.mark.parametrize(
    ("image", "window"),
    [
        *((GREY, window) for window in ((-50, -50, 10, 10), (300, 0, 330, 2), (2000, 0, 2100, 90))),
        (GREY, None),
        (np.zeros((200, 300, 3), np.uint8), None),
        (np.full((3, 3), 255, np.uint8), None),
    ],
)
def test_an_empty_image_or_window_gives_nothing(image, window):
    assert propose_circles(image, radii=(4, 25), window=window).shape == (0, 3)


@pytest.mark.parametrize(("level", "hidden"), [(215, 5.0), (120, 5.0), (45, 2.5)])
@pytest.mark.parametrize("turn", [0, 50, 100, 150])
def test_a_partly_hidden_disc_is_proposed(level, hidden, turn):
    """A straight edge hides `hidden` of its diameter of 15.2 pixels: 28 or 11 % of the area."""
    disc = np.array([30.3, 29.8, 7.6])
    canvas = np.full((60, 60, 3), 215.0)
    draw_disc(canvas, disc, (45, 45, 45), 1.0)
    rows, columns = np.ogrid[:60, :60]
    angle = np.deg2rad(turn)
    beyond = (columns - disc[0]) * np.cos(angle) + (rows - disc[1]) * np.sin(angle) - (7.6 - hidden)
    canvas += step(beyond, 1.0)[:, :, None] * (level - canvas)
    found = propose_circles(exposed(canvas, shading=0.1, noise=3.0, seed=turn), radii=(5.3, 9.9))
    assert np.hypot(*(found[:, :2] - disc[:2]).T).min() < 3


def test_discs_that_touch_are_told_apart_and_none_is_proposed_twice():
    canvas = np.full((120, 160, 3), 200.0)
    discs = np.array([(50.0, 60.0, 10.0), (71.0, 60.0, 10.0)])
    for disc in discs:
        draw_disc(canvas, disc, (40, 40, 40), 0.8)
    found = propose_circles(canvas.astype(np.uint8), DARK, radii=(6, 14))
    assert len(found) == 2
    assert np.abs(found[np.argsort(found[:, 0])] - discs).max() < 2


def test_the_picture_to_check_by_eye_shows_what_has_the_colour():
    scene = dots(7.6, noise=0.0, blur=0.5, shading=0.0, size=(640, 360))
    picture, share = highlight_colour(scene.image, ColourRange((0, -128, -128), (40, 127, 127)))
    magenta = (picture == (200, 0, 200)).all(axis=2)
    assert magenta.mean() == pytest.approx(share)
    assert share == pytest.approx(np.pi * (scene.discs[:, 2] ** 2).sum() / (640 * 360), rel=0.05)
