"""The soft beam: COMSOL's figures, the frame, the markers on a turned beam, the page."""

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.validation import comsol, printed_finger
from benchmarks.validation.document import PAGE
from benchmarks.validation.half_beam import HEIGHT, POISSON, WIDTH, HalfBeam, loaded_nodes
from benchmarks.validation.markers import (
    FEET,
    LOADS,
    NOMINAL,
    PATCHES,
    frames,
    length,
    marker_places,
    measured,
    moved_feet,
    read_runs,
    rigid_fit,
)
from benchmarks.validation.printed_finger import FINGERS
from benchmarks.validation.study import all_cases, predict


@pytest.fixture(scope="module")
def beam() -> HalfBeam:
    return HalfBeam()


def test_a_stiff_beam_bends_as_beam_theory_says(beam):
    """The last 70 mm, because the clamp stiffens the rest; the difference is 0.4 %.

    The section's turn is that of its chord, against which it is sheared by the mean shear F/GA.
    """
    modulus, load, arm = 1e3, 0.5, 70.0  # so stiff that strains are small: the tip falls by 0.003 mm
    second_moment = WIDTH * HEIGHT**3 / 12
    shear_stiffness = WIDTH * HEIGHT * modulus / (2 * (1 + POISSON))
    expected = load * arm**3 / (3 * modulus * second_moment) + load * arm / shear_stiffness
    points = np.array([[0, 15, 15], [-arm, 15, 15], [-arm, 15, 0], [-arm, 15, 30]], dtype=float)
    tip, cut, low, high = beam.solve(modulus, load).at(points) - beam.solve(modulus, 0.0).at(points)
    turn = (high[0] - low[0]) / HEIGHT
    assert cut[2] - tip[2] - turn * arm == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("strip", [0.0, 6.0])
def test_half_of_the_load_is_on_half_of_the_beam(beam, strip):
    nodes, shares = loaded_nodes(beam.nodes, strip)
    assert shares.sum() == pytest.approx(0.5, rel=1e-12)
    assert shares @ (HEIGHT - beam.nodes[nodes, 2]) == pytest.approx(0.5 * strip / 2, abs=1e-12)


def test_markers_of_a_beam_that_turns_turn_with_it():
    turn = Rotation.from_rotvec([0.1, 0.5, -0.2])
    nodes = (FEET[:, None] + PATCHES).reshape(-1, 3)

    class Turned:
        def at(self, points):
            assert all(np.isclose(nodes, point).all(axis=1).any() for point in points)
            return turn.apply(points) - points

    np.testing.assert_allclose(marker_places(Turned()), turn.apply(NOMINAL[:3]), atol=1e-12)


def test_the_frame_undoes_a_rigid_motion():
    turn, away = Rotation.from_rotvec([0.3, -0.2, 2.0]), np.array([5.0, -7.0, 100.0])
    fitted = rigid_fit(turn.apply(NOMINAL) + away, NOMINAL)
    np.testing.assert_allclose(fitted.of(turn.apply(NOMINAL) + away), NOMINAL, atol=1e-9)


def test_both_films_of_gravity_have_the_same_rest():
    """Within 0.1 mm, twice the difference; with a frame each they have 0.4 mm: hands hold the beam."""
    runs = read_runs()
    together, alone = (
        length(np.diff(measured(runs, frames(runs, each_run=each))["gravity"], axis=0)[0])
        for each in (False, True)
    )
    assert together < 0.1 < 0.3 < alone


@pytest.mark.slow
def test_coarse_tetrahedra_have_the_figures_of_comsol():
    """The page promises 0.2 mm; the other law, or the load 6 mm lower, is further away."""
    found = all_cases(HalfBeam(cell="tetrahedron", strip=0.0), comsol.MODULUS)
    for case, places in comsol.PLACES.items():
        np.testing.assert_allclose(moved_feet(found[case]), places, rtol=0, atol=0.2)


@pytest.mark.release
def test_the_page_has_the_modulus_and_the_errors_of_the_program(beam):
    """The page's are of a finer mesh: 1 kPa and 0.03 mm away."""
    runs = read_runs()
    outcome = predict(beam, measured(runs, frames(runs)))
    text = PAGE.read_text(encoding="utf-8")
    (said,) = re.findall(r"\*\*E =\s+(\d+)\s+kPa\*\*", text)
    assert 1000 * outcome.modulus == pytest.approx(float(said), abs=2)
    for case in LOADS:
        (row,) = re.findall(rf"^\| {case}, \w+ \|(.*)\|$", text, re.MULTILINE)
        assert outcome.error(case) == pytest.approx(float(row.split("|")[2]), abs=0.05)


@pytest.mark.parametrize("finger", FINGERS, ids=["A", "B"])
def test_drawings_of_the_printed_fingers_are_what_the_code_draws(finger, tmp_path, monkeypatch):
    kept = [finger.drawing.with_suffix(suffix).read_text(encoding="utf-8") for suffix in (".svg", ".toml")]
    monkeypatch.setattr(printed_finger, "FOLDER", tmp_path)
    finger.draw()
    made = [finger.drawing.with_suffix(suffix).read_text(encoding="utf-8") for suffix in (".svg", ".toml")]
    assert made == kept
