"""`pinnray material`: a tensile test, and the list of materials."""

import pytest

from pinnray.cli import main
from solvers.materials import MATERIALS


def test_a_tensile_test_ends_with_the_options_for_compare(tmp_path, capsys):
    """A neo-Hookean strip of 2 MPa; at a strain of 1 % the modulus is its own."""
    file = tmp_path / "strip.csv"
    rows = [(s, 2 / 3 * ((1 + s) - (1 + s) ** -2)) for s in (0.01, 0.1, 0.2, 0.3, 0.4)]
    file.write_text("strain,stress_MPa\n" + "".join(f"{s},{p}\n" for s, p in rows))
    picture = tmp_path / "strip.png"
    assert main(["material", str(file), "--poisson", "0.499", "--out", str(picture)]) == 0
    out = capsys.readouterr().out
    young = float(out.partition("--young ")[2].split()[0])
    assert young == pytest.approx(2.0, rel=0.01)
    assert "--poisson 0.499 --law neo-hookean" in out
    assert "secant modulus at 10%" in out
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_without_a_test_the_materials_are_listed_with_their_sources(capsys):
    assert main(["material"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(MATERIALS)
    assert all("MPa" in line and "breaks at" in line for line in lines)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--poisson", "0.5"], "below 0.5"),
        (["--out", "strip.pdf"], "name of a picture"),
        (["--strain", "0.01"], "three are needed"),
    ],
)
def test_bad_input_is_one_line(tmp_path, capsys, arguments, said):
    file = tmp_path / "strip.csv"
    file.write_text("strain,stress_MPa\n0.1,1\n0.2,2\n0.3,3\n")
    assert main(["material", str(file), *arguments]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert len(err.splitlines()) == 1
