"""`pinnray solve`: forces at strokes on the way, and a finger that snaps away before the last one."""

import pytest

from pinnray.cli import main
from pinnray.runtime.exits import BAD_INPUT, NOT_CONVERGED
from tests.geometry.drawing.files import write_svg

ARCH = '<path d="M 0 4 L 38 0 H 46 L 84 4 V 5.2 L 46 1.2 H 38 L 0 5.2 Z"/>'
SIZE = 'width="84mm" height="7mm" viewBox="0 0 84 7"'
HELD = "clamp=[[[0,-4],[0,-5.2]],[[84,-4],[84,-5.2]]]"


@pytest.fixture
def arch(tmp_path, monkeypatch):
    """Options of a shallow arch that is held at both feet."""
    monkeypatch.chdir(tmp_path)
    drawn = ["--section", str(write_svg(tmp_path / "arch.svg", ARCH, SIZE))]
    where = [HELD, "contact=[42,0]", "contact_width=4", "markers=3"]
    drawn += [text for each in where for text in ("--set", each)]
    return [*drawn, *["--young", "10", "--poisson", "0.3", "--mesh-size", "4", "--out", "arch.vtu"]]


def test_a_finger_that_snaps_away_keeps_its_known_forces(arch, tmp_path, capsys):
    pressed = ["solve", "fem-nonlinear", "--load", "cylinder", "--stroke", "8", "--strokes", "1,2,7"]
    assert main([*pressed, *arch]) == NOT_CONVERGED
    said = capsys.readouterr()
    assert "the finger snaps away from the cylinder at 4." in said.out
    lines = [line.split() for line in said.out.splitlines()]
    rows = {line[-2]: line[1:-3] for line in lines if line[:1] == ["force"] and line[-1] == "mm"}
    assert rows["7"] == ["not", "known"]
    assert float(rows["1"][0]) == pytest.approx(0.09, rel=0.1)
    assert float(rows["2"][0]) == pytest.approx(0.075, rel=0.1)
    assert "not at 7 mm" in said.err
    assert (tmp_path / "arch.vtu").exists()
    assert (tmp_path / "arch_force_displacement.csv").exists()


def test_a_stroke_beyond_the_last_is_refused_before_anything_is_solved(arch, tmp_path, capsys):
    assert main([*["solve", "fem-nonlinear", "--stroke", "8", "--strokes", "9"], *arch]) == BAD_INPUT
    assert "--strokes 9: the stroke ends at 8 mm" in capsys.readouterr().err
    assert not (tmp_path / "arch.vtu").exists()
