"""The markers that the first pages use: they say that they are simulated, and how."""

import numpy as np
import pytest

from pinnray.geometry.finger.markers import marker_positions
from pinnray.geometry.finger.presets import load_design
from pinnray.vision.measurements import read_measurements
from tests.test_docs import ROOT

FILE = ROOT / "examples" / "markers.csv"


def test_the_shipped_markers_are_those_of_the_default_finger_and_simulated():
    seen = read_measurements(FILE, marker_radius=0.8)
    assert seen.label == "simulated"
    np.testing.assert_allclose(seen.points, marker_positions(load_design()), atol=0.0005)
    assert (seen.standard_deviations == 0.02).all()


@pytest.mark.release
def test_the_shipped_markers_are_made_as_their_file_says(without_pictures):
    from pinnray import compare

    made = [line.strip("# \n") for line in FILE.read_text(encoding="utf-8").splitlines() if "#     " in line]
    names = {"pr": type("pr", (), {"compare": staticmethod(compare)}), "np": np}
    exec(made[0], names)
    np.testing.assert_allclose(
        read_measurements(FILE, marker_radius=0.8).displacements, eval(made[1], names), atol=0.001
    )
