"""`pinnray points`: measurements that `compare` reads, what was found in words, and bad input in one line."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.validation.printed_finger import FINGERS
from pinnray.cli import main
from pinnray.geometry.picture_frame import HAND_HELD
from pinnray.vision.measurements import read_measurements

FINGER = FINGERS[1]
GIVEN = ["points", *map(str, FINGER.clicks), "--section", str(FINGER.drawing)]


def test_two_lists_become_measurements(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main([*GIVEN, "--scale", "lengths"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("scale 1.0409 mm per unit at rest, 1.01 pressed\n")
    written = read_measurements(Path("out/observations.csv"), marker_radius=0.2)
    assert len(written.points) == 14
    assert written.pressed == HAND_HELD
    assert not written.simulated
    # The finger moved by 11.6 mm (rms) and the points nearest to its feet least.
    moved = np.linalg.norm(written.displacements, axis=1)
    assert np.sqrt((moved**2).mean()) == pytest.approx(11.6, abs=0.1)
    assert moved.argmin() == written.points[:, 0].argmin()


def test_given_scales_are_those_of_the_pictures(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main([*GIVEN, "--scale", "1.03,1.02"]) == 0
    assert capsys.readouterr().out.startswith("scale 1.03 mm per unit at rest, 1.02 pressed\n")
