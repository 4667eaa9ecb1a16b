"""`pinnray material`: a tensile test, and the list of materials."""

import re

import pytest

import pinnray as pr
from pinnray.cli import main
from pinnray.solvers.materials import MATERIALS


def test_a_tensile_test_ends_with_the_options_for_compare(tmp_path, capsys):
    """A neo-Hookean strip of 2 MPa; at a strain of 1 % the modulus is its own."""
    file = tmp_path / "strip.csv"
    rows = [(s, 2 / 3 * ((1 + s) - (1 + s) ** -2)) for s in (0.01, 0.1, 0.2, 0.3, 0.4)]
    file.write_text("strain,stress_MPa\n" + "".join(f"{s},{p}\n" for s, p in rows))
    picture = tmp_path / "strip.png"
    assert main(["material", str(file), "--poisson", "0.499", "--out", str(picture)]) == 0
    out = capsys.readouterr().out
    young, deviation = map(float, out.partition("--young ")[2].split()[0].split("±"))
    assert young == pytest.approx(2.0, rel=0.01)
    assert deviation < 0.01 * young  # as little as the law misses
    assert "--poisson 0.499 --law neo-hookean" in out
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_where_the_linear_law_fits_best_both_laws_have_their_options(tmp_path, capsys):
    file = tmp_path / "strip.csv"
    file.write_text("strain,stress_MPa\n" + "".join(f"{n / 50},{n / 5}\n" for n in range(1, 16)))
    assert main(["material", str(file)]) == 0
    small, finite = capsys.readouterr().out.splitlines()[-2:]
    assert re.fullmatch("small strain: --young 10±.* --poisson 0.45 --law linear", small)
    found = re.fullmatch("finite strain: --young (.*)±(.*) --poisson 0.45 --law neo-hookean", finite)
    assert float(found[1]) == pytest.approx(12.0, abs=0.1)
    assert 0.03 < float(found[2]) / float(found[1]) < 0.2  # the straight line's stress is missed by that


def test_without_a_test_the_materials_are_listed_with_their_sources(capsys):
    assert main(["material"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(MATERIALS)


@pytest.mark.slow
def test_a_known_material_gives_modulus_and_ratio_unless_they_are_given(tmp_path, capsys):
    """Force is in proportion to the modulus, for one ratio."""
    forces = {}
    arguments = {
        "sheet": ["--material", "tpu-85a"],
        "own modulus": ["--material", "tpu-85a", "--young", "24"],
        "by hand": ["--young", "12", "--poisson", "0.45"],
    }
    for name, chosen in arguments.items():
        out = str(tmp_path / "fields.vtu")
        assert main(["solve", "fem", "--mesh-size", "2", "--strokes", "4", "--out", out, *chosen]) == 0
        lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("force  ")]
        at_four, whole = (float(line.split()[1]) for line in lines)
        assert at_four == pytest.approx(0.4 * whole, rel=1e-3)
        forces[name] = whole
    assert forces["sheet"] == pytest.approx(forces["by hand"])
    assert forces["own modulus"] == pytest.approx(2 * forces["sheet"], rel=1e-3)


def test_a_material_is_named_in_python_too():
    solution = pr.solve("default", material="dragon-skin-30", size=2.0)
    same = pr.solve("default", material=pr.MATERIALS["dragon-skin-30"].material, size=2.0)
    assert same.force == solution.force
    assert solution.problem.material.young == pr.MATERIALS["dragon-skin-30"].material.young
    assert solution.figures.force == pytest.approx(solution.force)
    assert solution.figures.force_at(5.0) == pytest.approx(solution.force / 2)
