"""Short lines stay; gaps are named, and closed within a tolerance that is given."""

from itertools import pairwise

import ezdxf
import numpy as np
import pytest

from pinnray.geometry import UserError
from pinnray.geometry.drawing.checks import body
from pinnray.geometry.drawing.description import Description
from pinnray.geometry.drawing.drawn_finger import description_lines
from pinnray.geometry.drawing.formats.closed_loops import closed_loops
from pinnray.geometry.drawing.formats.pieces import line
from pinnray.geometry.drawing.load import finger_from_file, read_drawing
from tests.geometry.drawing.files import BEAM, write_dxf

ROUND = 0.1
"""Radius of the fine corners, mm."""


def fine_beam(step: float, seed: int = 0, noise: float = 0.0) -> np.ndarray:
    """The beam's corners, the last one rounded by lines of a length, with noise on them, mm."""
    count = int(np.ceil(ROUND * np.pi / 2 / step))
    angles = np.linspace(0, np.pi / 2, count + 1)
    arc = np.stack([100 - ROUND + ROUND * np.cos(angles), -ROUND + ROUND * np.sin(angles)], axis=1)
    arc[1:-1] += noise * np.random.default_rng(seed).standard_normal((len(arc) - 2, 2))
    return np.concatenate([BEAM[:3], arc])


def shoelace(corners: np.ndarray) -> float:
    x, y = corners.T
    return float(0.5 * abs((x * np.roll(y, -1) - y * np.roll(x, -1)).sum()))


@pytest.mark.parametrize("step", [1e-2, 1.1e-3, 9e-4, 3e-4])
def test_lines_shorter_than_the_tolerance_stay(tmp_path, step):
    corners = fine_beam(step)
    path = write_dxf(tmp_path / "a.dxf", [corners.tolist()])
    for tolerance in (None, 0.05):
        section = body(read_drawing(path, tolerance=tolerance).loops)
        assert section.area == pytest.approx(shoelace(corners), rel=1e-9)


def test_short_lines_with_small_gaps_stay():
    corners = fine_beam(5e-4)
    shift = 2e-5 * np.random.default_rng(1).standard_normal((len(corners), 2))  # of every end of its own
    pieces = [
        line(a + s, b, "") for a, b, s in zip(corners, np.roll(corners, -1, axis=0), shift, strict=True)
    ]
    loops = closed_loops(pieces).loops
    assert [abs(loop.area) for loop in loops] == pytest.approx([shoelace(corners)], rel=1e-5)
    assert len(loops[0].points) == len(corners)


def loose_beam(path, gap: float, units: int = 4, unit: float = 1.0):
    """The beam of four lines, each of which ends short of the next."""
    document = ezdxf.new(units=units)
    for start, end in zip(np.array(BEAM), np.array(BEAM[1:] + BEAM[:1]), strict=True):
        short = (end - start) / np.linalg.norm(end - start) * gap
        document.modelspace().add_line(start / unit, (end - short) / unit)
    document.saveas(path)
    return path


@pytest.mark.parametrize(("gap", "units", "unit"), [(0.002, 4, 1.0), (0.03, 4, 1.0), (0.002, 1, 25.4)])
def test_a_gap_is_named_with_the_tolerance_that_closes_it(tmp_path, gap, units, unit):
    path = loose_beam(tmp_path / "a.dxf", gap, units, unit)
    with pytest.raises(
        UserError, match=rf"is open at .*: a gap of {gap:g} mm to .* within 0.001 mm"
    ) as error:
        read_drawing(path)
    tolerance = float(str(error.value).rsplit("tolerance = ", 1)[1].split()[0])
    assert gap < tolerance < 1.5 * gap
    finger = finger_from_file(path, Description(tolerance=tolerance))
    assert f"4 gaps of up to {gap:g} mm closed" in finger.note
    assert finger.reading == {"tolerance": tolerance}
    assert f"# It was read as {finger.note}.\n" in description_lines(finger)
    assert finger.section.area == pytest.approx(1000, rel=2 * gap / 10)


def test_a_tolerance_that_closes_nothing_says_nothing(tmp_path):
    path = write_dxf(tmp_path / "a.dxf", [BEAM])
    assert "gap" not in read_drawing(path, tolerance=0.01).note


def test_no_end_is_joined_with_two_others():
    """Three loose ends within the tolerance: the nearest two are one, the third is open."""
    corners = [*BEAM, BEAM[0]]
    pieces = [line(a, b, "") for a, b in pairwise(corners)]
    pieces[0] = line((0.0, -4e-4), corners[1], "")
    pieces += [line((4e-4, 4e-4), (30, 20), ""), line((30, 20), (50, 20), "")]
    with pytest.raises(UserError, match=r"3 curves meet at \(0, -?0|is open at"):
        closed_loops(pieces)


def test_a_side_drawn_again_beside_the_first_is_refused():
    corners = [*BEAM, BEAM[0]]
    pieces = [line(a, b, "") for a, b in pairwise(corners)]
    pieces.append(line((100.0, -1e-4), (1e-4, 0.0), ""))  # again, 0.1 um beside
    with pytest.raises(UserError, match="is open at"):
        closed_loops(pieces)
