"""Printed dots are found, as accurately as their noise allows, though no ellipse fits them."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.vision.discs import disc_image_model as model
from pinnray.vision.discs.disc_fit import FittedDiscs, fit_discs
from pinnray.vision.rig.bench import Bench
from pinnray.vision.rig.exposure import Exposure
from pinnray.vision.rig.shapes import area, blot, centroid, closed
from pinnray.vision.tracking.scene import FilmedScene
from pinnray.vision.tracking.tracker import track
from tests.vision import films
from tests.vision.discs.printed_dots import INK, PAPER, PrintedDots, darkness_centroids

COUNTED = 48


def exposure(**changes: float) -> Exposure:
    return Exposure(**{"noise": 1.0, "gradient": 0.0, "monochrome": True, **changes})


def measured(dots: PrintedDots) -> tuple[FittedDiscs, np.ndarray, np.ndarray]:
    """Fitted dots from guesses half a pixel off, their errors, and those of plain centroids."""
    picture = dots.picture()
    rng = np.random.default_rng(1)
    guesses = dots.centres + rng.normal(0, 0.4, dots.centres.shape)
    radii = dots.radius * rng.uniform(0.9, 1.1, dots.count)
    discs = fit_discs(picture, np.column_stack([guesses, radii]))
    return discs, discs.centres - dots.centres, darkness_centroids(picture, dots) - dots.centres


def covered(discs: FittedDiscs, errors: np.ndarray) -> float:
    """Share of the coordinates within 1.96 standard deviations."""
    deviations = np.sqrt(np.diagonal(discs.covariances, axis1=1, axis2=2))
    return float((np.abs(errors) < 1.96 * deviations)[discs.found].mean())


def rms(errors: np.ndarray) -> float:
    """Root mean square distance."""
    return float(np.sqrt((errors**2).sum(axis=1).mean()))


@pytest.mark.parametrize(("radius", "irregular"), [(4.0, 0.08), (12.0, 0.03)])
def test_irregular_dots_are_as_accurate_as_round_ones(radius, irregular):
    discs, errors, _ = measured(PrintedDots(radius, irregular, count=COUNTED, seed=3))
    assert discs.found.sum() >= COUNTED - 1  # one of 48 may be so uneven that it could be hidden in part
    wrong = errors[discs.found]
    blur = np.hypot(0.8, 12**-0.5)
    bound = 2 / (235 * (PAPER - INK)) * np.sqrt(blur / (radius * np.sqrt(np.pi)))  # of a round one
    assert rms(wrong) < 1.7 * bound  # 1.1 on the average; 8 % at 4 pixels: 1.5
    assert covered(discs, errors) > 0.88  # 0.95 less four deviations of 96 coordinates


@pytest.mark.slow
@pytest.mark.parametrize(
    ("radius", "changes"),
    [
        (7.3, {"mottle": 0.1}),
        (3.0, {"exposure": exposure(sharpen=1.5), "irregular": 0.03}),  # the halo draws an ellipse away
        (7.3, {"exposure": exposure(blur=2.0), "irregular": 0.03}),  # out of focus
        (12.0, {"exposure": exposure(glare=60.0), "irregular": 0.03}),
        (7.3, {"exposure": exposure(noise=6.0), "irregular": 0.05}),
        # half of the light that is lost around a dot is known from the other dots: how it grows; 1.4 to 4
        # times the error with each dot's own gradient
        (4.0, {"exposure": exposure(white=400.0), "irregular": 0.03}),
        (12.0, {"exposure": exposure(white=400.0)}),
    ],
)
def test_no_plain_centroid_is_more_accurate(radius, changes):
    discs, errors, plain = measured(PrintedDots(radius, count=COUNTED, seed=3, **changes))
    assert discs.found.sum() >= COUNTED - 2
    assert rms(errors[discs.found]) < 1.2 * rms(plain)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("radius", "changes"),
    [
        (4.0, {"mottle": 0.1}),  # 0.73 by the residuals alone, of which the outline takes up most
        (4.0, {"exposure": exposure(white=400.0, gradient=0.3), "irregular": 0.03}),
        (12.0, {"exposure": exposure(white=400.0)}),  # 0.99 if light is uneven by assumption
    ],
    ids=["specks", "uneven light on clipped white", "even light on clipped"],
)
def test_the_intervals_of_dots_hold(radius, changes):
    dots = PrintedDots(radius, count=96, seed=5, **changes)
    discs, errors, _ = measured(dots)
    assert 0.86 < covered(discs, errors) < 0.99  # 192 coordinates, each deviation of 0.95 is 0.016


def test_derivatives_of_an_irregular_disc_are_differences():
    rng = np.random.default_rng(0)
    start = np.zeros((1, model.COUNT + model.OUTLINE + model.EDGE))
    own = [model.RADIUS, model.BLUR, model.LIGHT, model.CONTRAST, model.HALO]
    start[:, own] = 8.0, 1.0, 180.0, 120.0, 0.4
    start[:, model.COUNT : model.HALO] = 0.002 * rng.standard_normal(model.HALO - model.COUNT)
    start[:, model.COUNT + model.OUTLINE :] = 0.4, 9.0, 60.0, 0.005
    line = np.arange(-12, 13, dtype=np.float32)
    x, y = (part.ravel() for part in np.meshgrid(line, line))
    away = np.hypot(x, y) > 3  # the waves have no direction in the middle
    _, derivatives = model.disc_image(start.astype(np.float32), x, y)
    columns = [0, 1, model.RADIUS, model.COUNT, model.COUNT + 5, model.HALO - 1, model.HALO]
    for column in (*columns, *range(model.COUNT + model.OUTLINE, start.shape[1])):
        step = 1e-2 if column in (0, 1, model.RADIUS) else 1e-3
        ends = []
        for sign in (1, -1):
            moved = start.copy()
            moved[0, column] += sign * step
            ends.append(model.disc_image(moved.astype(np.float32), x, y)[0][0])
        slope = (ends[0] - ends[1]) / (2 * step)
        scale = np.abs(slope[away]).max()
        # Without the change of the edge's slope, of second order in the heights of the waves.
        assert np.abs(derivatives[0, column] - slope)[away].max() < 0.06 * scale


def test_the_outline_of_a_blot_has_the_discs_area_and_centroid():
    edges = closed(blot((3.0, -2.0), 0.8, 0.05, np.random.default_rng(4)))
    assert area(edges) == pytest.approx(np.pi * 0.8**2, rel=1e-9)
    # The rescaled area's centroid, to the waves' second order: it is moved by the centroid before.
    np.testing.assert_allclose(centroid(edges), (3.0, -2.0), atol=1e-9)
    reach = np.linalg.norm(edges[:, 0] - (3.0, -2.0), axis=1) / 0.8
    assert reach.std() == pytest.approx(0.05, rel=0.02)


@pytest.mark.release
def test_a_film_of_printed_dots_is_tracked_to_thousandths_of_a_millimetre():
    recording = films.recording()
    mesh = finger_mesh(films.DESIGN, settings=MeshSettings(size=1.0))
    bench = Bench(mesh, films.DESIGN, films.WORKSPACE, irregular=0.05)
    pictures, truths = zip(*replace(recording, bench=bench).frames(), strict=True)
    scene = FilmedScene(films.DESIGN, films.WORKSPACE, films.CAMERA)
    tracking = track(films.frames_of(pictures), scene)
    before, after = tracking.rest_positions
    assert np.abs(after - before - (truths[-1].discs - truths[0].discs)).max() < 0.003  # 0.02 pixels
