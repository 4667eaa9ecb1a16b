"""`--section`: drawings in place of parameters, and what is refused, in one line with exit code 2."""

from pathlib import Path

import pytest

from pinnray.cli import main
from pinnray.comparison.pipeline.job import Job
from pinnray.geometry.cache import drawn_finger
from pinnray.geometry.drawing.description import Description
from pinnray.geometry.drawing.drawn_finger import DrawnFinger
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.options.shared import FingerOptions
from pinnray.runtime.errors import UserError
from pinnray.studies.crossval.study import CrossvalStudy
from tests.geometry.drawing.files import write_beam_mesh

BEAM = "M 0 0 L 0 -10 L 60 -10 L 60 0 Z"


def drawing(folder: Path, path: str = BEAM, *, name: str = "beam.svg", size: str = "100mm") -> Path:
    """An SVG file with a path in millimetres, y up; nothing but its size has a unit."""
    file = folder / name
    file.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{size}" height="{size}" viewBox="-20 -50 100 100">'
        f'<g transform="scale(1 -1)"><path d="{path}"/></g></svg>'
    )
    return file


def test_lines_on_the_command_line_are_those_of_a_description(tmp_path: Path) -> None:
    places = {"clamp": "[[0, 0], [0, -10]]", "contact": "[40, 0]", "markers": "5"}
    options = FingerOptions(section=drawing(tmp_path), set=("depth=12",), **places)
    finger, _ = options.read()
    assert isinstance(finger, DrawnFinger)
    assert (finger.contact_abscissa, finger.depth, len(finger.markers)) == (40.0, 12.0, 5)
    assert finger.section.area == pytest.approx(600, rel=1e-12)


def test_a_description_beside_the_drawing_counts_and_the_command_line_wins(tmp_path: Path) -> None:
    file = drawing(tmp_path)
    file.with_suffix(".toml").write_text("depth = 7\ncontact = [30, 0]\n")
    finger, _ = FingerOptions(section=file, contact="[45, 0]").read()
    assert (finger.depth, finger.contact_abscissa) == (7.0, 45.0)


def test_places_on_a_drawing_are_refused_for_a_design() -> None:
    with pytest.raises(UserError, match="--contact belongs to a drawing; give it by --section FILE"):
        FingerOptions(contact="[45, 0]").read()


def test_design_says_that_a_size_is_a_guess(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = drawing(tmp_path, size="100")
    assert main(["design", "--section", str(file), "--formats", "dxf", "--out", str(tmp_path / "out")]) == 0
    assert "note: beam.svg was read as SVG, 0.264583 mm in a user unit (assumed" in capsys.readouterr().err
    assert "(assumed" in (tmp_path / "out" / "beam.toml").read_text()


@pytest.mark.parametrize(
    ("line", "own"),
    [
        ("", True),  # taken as it is
        ("--mesh-size 0.25", False),  # the default of other fingers, asked for
    ],
)
def test_the_mesh_of_a_file_is_left_only_for_a_size_that_is_asked_for(line, own, tmp_path, capsys):
    file = write_beam_mesh(tmp_path / "beam.msh")
    assert main(["mesh", "--section", str(file), *line.split(), "--out", str(tmp_path / "out")]) == 0
    kept = drawn_finger(file, Description()).mesh
    assert kept is not None
    assert (f", {len(kept.triangles)} triangles" in capsys.readouterr().out) == own


def test_no_command_takes_its_usual_size_for_one_that_is_asked_for(tmp_path: Path) -> None:
    options, usual = FingerOptions(section=write_beam_mesh(tmp_path / "beam.msh")), MeshSettings(size=0.5)
    finger, sizes = options.read("fast", usual)
    assert sizes is None
    assert (Job(finger, []).mesh, CrossvalStudy(design=finger, solvers=[], out=tmp_path).mesh) == (
        None,
        None,
    )
    assert FingerOptions().read("fast", usual)[1] == usual
    assert FingerOptions(mesh_size=0.25).read("fast", usual)[1] == MeshSettings()
    design = FingerOptions().read()[0]
    assert Job(design, []).mesh == MeshSettings()
    assert CrossvalStudy(design=design, solvers=[], out=tmp_path).mesh == usual
    asked = MeshSettings()
    assert Job(finger, [], mesh=asked).mesh == asked
