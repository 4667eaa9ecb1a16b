"""Pictures of single shapes, against what camera, lens and sensor do to them by their formulas."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.special import erf

from pinnray.vision.calibration.camera import Camera, Pose
from pinnray.vision.rig.exposure import Exposure
from pinnray.vision.rig.render import mean_light, render
from pinnray.vision.rig.shapes import Scene, Shape, circle, closed, rectangle

BLACK, WHITE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
PINHOLE = Camera(120, 80, 900.0, 880.0, 61.0, 38.0)
LENS = Camera(60, 40, 55.0, 56.0, 30.5, 19.0, distortion=(-0.25, 0.08, 2e-3, -1e-3, 0.02))
ABOVE = Pose(np.array([np.pi, 0.0, 0.0]), np.array([0.0, 0.0, 100.0]))
TILTED = Pose(np.array([3.0, 0.2, -0.15]), np.array([1.0, -2.0, 90.0]))
PLAIN = Exposure(white=200, gradient=0, blur=0, noise=0)


def light(shape, camera, pose, blur=0.0):
    return mean_light([Scene(BLACK, [shape])], camera, pose, blur)[:, :, 0].astype(np.float64)


@pytest.mark.parametrize("blur", [0.0, 0.5, 0.8, 1.5, 3.0])
def test_a_disc_has_its_centroid_where_its_centre_is_projected(blur):
    centre = np.array([1.234, -0.577])
    picture = light(Shape(closed(circle(centre, 0.85)), WHITE, z=2.0), PINHOLE, ABOVE, blur)
    y, x = np.mgrid[:80, :120]
    found = np.array([(x * picture).sum(), (y * picture).sum()]) / picture.sum()
    # The sum over pixels is the integral for pictures without frequencies from one a pixel on: not if sharp.
    tolerance = 3e-4 if blur else 2e-3
    np.testing.assert_allclose(found, PINHOLE.project([[*centre, 2.0]], ABOVE)[0], rtol=0, atol=tolerance)


def test_a_rectangle_seen_askew_through_a_lens_is_what_rays_from_the_pixels_meet():
    low, high, z, fine = np.array([-30, -15]), np.array([21, 17]), 3.0, 16
    picture = light(Shape(rectangle(low, high), WHITE, z), LENS, TILTED)
    offsets = (np.arange(fine) + 0.5) / fine - 0.5
    x = (np.arange(60)[:, None] + offsets).ravel()
    y = (np.arange(40)[:, None] + offsets).ravel()
    pixels = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    plain = (LENS.undistort(pixels) - (LENS.cx, LENS.cy)) / (LENS.fx, LENS.fy)
    rotation = Rotation.from_rotvec(TILTED.rotation).as_matrix()
    rays = np.column_stack([plain, np.ones(len(plain))]) @ rotation
    eye = -rotation.T @ TILTED.translation
    met = eye + rays * ((z - eye[2]) / rays[:, 2])[:, None]
    inside = ((met[:, :2] > low) & (met[:, :2] < high)).all(axis=1)
    expected = inside.reshape(40, fine, 60, fine).mean(axis=(1, 3))
    # The midpoint rule with 16 x 16 points misses up to half a column of them where an edge runs along it.
    np.testing.assert_allclose(picture, expected, rtol=0, atol=0.55 / fine)
    border = 2 * (31 + 20)
    assert picture.sum() == pytest.approx(expected.sum(), abs=1e-3 * border)


@pytest.mark.parametrize("blur", [0.5, 0.8, 1.5, 3.0])
def test_the_lens_blurs_an_edge_to_the_integral_of_a_normal_distribution(blur):
    edge = 0.237
    picture = light(Shape(rectangle((edge, -50), (90, 50)), WHITE), PINHOLE, ABOVE, blur)[40]
    x = np.arange(120) - PINHOLE.project([[edge, 0, 0]], ABOVE)[0, 0]

    def integral(x):
        s = x / (np.sqrt(2) * blur)
        return x * (1 + erf(s)) / 2 + blur * np.exp(-(s**2)) / np.sqrt(2 * np.pi)

    np.testing.assert_allclose(picture[:110], (integral(x + 0.5) - integral(x - 0.5))[:110], atol=0.005)


def test_later_shapes_hide_earlier_ones():
    scene = Scene(
        BLACK, [Shape(rectangle((-2, -2), (2, 2)), (0.1, 0.2, 0.3)), Shape(rectangle((0, -9), (9, 9)), WHITE)]
    )
    picture = render(scene, PINHOLE, ABOVE, PLAIN)
    (left, y), (right, _) = np.rint(PINHOLE.project([[-1, 0, 0], [1, 0, 0]], ABOVE)).astype(int)
    np.testing.assert_array_equal(picture[y, [left, right, 0]], [[20, 40, 60], [200] * 3, [0] * 3])


@pytest.mark.parametrize(
    ("settings", "deviation"),
    [
        ({"noise": 6.0}, 6.0),
        ({"full_well": 10_000.0}, np.sqrt(120 * 255 / 10_000)),
        ({"noise": 2.0, "full_well": 10_000.0}, np.sqrt(4 + 120 * 255 / 10_000)),
    ],
)
def test_noise_has_the_variance_that_was_set(settings, deviation):
    scene = Scene((0.6,) * 3, [])
    noisy = Exposure(**{**PLAIN.model_dump(), **settings})
    values = render(scene, PINHOLE, ABOVE, noisy, seed=3).astype(np.float64)
    assert values.mean() == pytest.approx(120, abs=0.15)
    # Rounding adds 1/12; the deviation of 28,800 numbers is known to 0.4 %.
    assert values.std() == pytest.approx(np.sqrt(deviation**2 + 1 / 12), rel=0.02)


def test_light_grows_towards_the_side_it_comes_from():
    lit = Exposure(**{**PLAIN.model_dump(), "gradient": 0.2, "gradient_direction": 0})
    picture = render(Scene((0.6,) * 3, []), PINHOLE, ABOVE, lit)[:, :, 1]
    np.testing.assert_array_equal(picture[0], picture[-1])
    np.testing.assert_array_equal(picture[0, [0, -1]], [96, 144])


def test_the_lens_blurs_the_light_that_the_lamp_throws_on_the_scene():
    """A lamp that lit the picture would leave the centroid of a disc, once divided out, where it is."""
    blur, slope = 2.0, 0.01
    lamp = Exposure(gradient=60 * slope, gradient_direction=0).lamp
    disc = Scene(BLACK, [Shape(closed(circle((0.0, 0.0), 0.85)), WHITE)])
    x, middle = (
        np.arange(120) - (120 - 1) / 2,
        PINHOLE.project([[0.0, 0.0, 0.0]], ABOVE)[0, 0] - (120 - 1) / 2,
    )
    seen = mean_light([disc], PINHOLE, ABOVE, blur, lamp)[:, :, 1].astype(np.float64).sum(axis=0)
    even = seen / (1 + slope * x)
    found = (even * x).sum() / even.sum() - middle
    # The blurred product is the product of lamp and blurred disc and blur² times that of their slopes. A
    # pixel, over which light is summed, adds a twelfth to blur²; the lamp's level changes it by 1.5 % across
    # the disc.
    assert found == pytest.approx(-slope * (blur**2 + 1 / 12) / (1 + slope * middle), rel=0.03)


def test_a_monochrome_picture_has_the_luma_of_the_colours():
    scene = Scene((0.2, 0.4, 0.8), [])
    grey = render(scene, PINHOLE, ABOVE, Exposure(**{**PLAIN.model_dump(), "monochrome": True}))
    assert grey.shape == (80, 120)
    assert (grey == np.rint(200 * (0.114 * 0.2 + 0.587 * 0.4 + 0.299 * 0.8))).all()
