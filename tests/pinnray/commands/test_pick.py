"""`pinnray pick`: a colour that can be pasted, and a picture of what has it."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from pinnray.cli import main

RED = (40, 40, 200)


@pytest.fixture(autouse=True)
def shots(tmp_path, monkeypatch):
    """Two pictures, with three red discs of radius 8 at (50, 40), (90, 40) and (130, 40) on the second."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    image = np.full((80, 160, 3), 210, np.uint8)
    Path("shots").mkdir()
    cv2.imwrite("shots/1.png", image)
    for x in (50, 90, 130):
        cv2.circle(image, (x, 40), 8, RED, -1, cv2.LINE_AA)
    cv2.imwrite("shots/2.png", image)


def test_a_click_gives_a_colour_and_a_picture(capsys):
    assert main(["pick", "shots", "--frame", "1", "--at", "51,39"]) == 0
    colour, found, path = capsys.readouterr().out.splitlines()
    assert colour.startswith("--colour ")
    share, _, _ = found.partition("% of the image")
    assert float(share) == pytest.approx(100 * 3 * np.pi * 64 / 12800, rel=0.1)
    assert path == "out/pick.png"
    picture = cv2.imread("out/pick.png")
    magenta = (picture == (200, 0, 200)).all(axis=2)
    assert magenta[40, [50, 90, 130]].all()
    assert not magenta[40, [35, 70, 110, 150]].any()
    option, text = colour.split()
    assert main(["pick", "shots/2.png", option, text, "--out", "again.png"]) == 0
    assert capsys.readouterr().out.splitlines()[0] == colour


def test_a_picture_comes_through_a_pipe(monkeypatch, capsys):
    with Path("shots/2.png").open() as file:
        monkeypatch.setattr("sys.stdin", file)
        assert main(["pick", "-", "--at", "51,39"]) == 0
    assert "of the image" in capsys.readouterr().out
