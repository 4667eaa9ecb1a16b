"""Marker displacements as CSV, as written here and as they come from elsewhere; units mm."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pinnray.geometry.observations import Observations
from pinnray.geometry.picture_frame import FIXED, FREE, HAND_HELD, Registration
from pinnray.vision.measurements import read_measurements, write_measurements

HEADER = "x_mm,y_mm,u_mm,v_mm"


def observations(
    *, hidden: tuple[int, ...] = (), source: str = "camera A", simulated: bool = False
) -> Observations:
    """Five markers with numbers that have no short decimal form."""
    rng = np.random.default_rng(3)
    visible = np.ones(5, dtype=bool)
    visible[list(hidden)] = False
    return Observations(
        points=rng.normal(size=(5, 2)) * 1e3,
        displacements=rng.normal(size=(5, 2)) / 3,
        standard_deviations=rng.uniform(size=(5, 2)) * 1e-9,
        visible=visible,
        source=source,
        simulated=simulated,
        marker_radius=0.6,
    )


def read(folder: Path, content: str | bytes) -> Observations:
    path = folder / "markers.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_measurements(path, marker_radius=0.6)


@pytest.mark.parametrize("simulated", [True, False])
@pytest.mark.parametrize(
    "source",
    [
        "camera A",
        "two cameras, mean of 30 frames; 25 °C",  # commas and letters beyond ASCII
        '"quoted"',
        "# simulated",  # a source that looks like the mark is none
        "camera A\nsecond\u2028third",  # stays a comment of one line
    ],
)
def test_what_was_written_is_read_back_to_the_last_digit(tmp_path, source, simulated):
    path = tmp_path / "markers.csv"
    written = observations(hidden=(1, 4), source=source, simulated=simulated)
    write_measurements(path, written)
    x, y = written.points[1].tolist()
    assert f"2,{x!r},{y!r},,,,,0" in path.read_text(encoding="utf-8").splitlines()  # where it is, only
    back = read_measurements(path, marker_radius=0.6)
    np.testing.assert_array_equal(back.visible, written.visible)
    np.testing.assert_array_equal(back.points, written.points)
    for name in ("displacements", "standard_deviations"):
        found, expected = getattr(back, name), getattr(written, name)
        np.testing.assert_array_equal(found[written.visible], expected[written.visible], err_msg=name)
        assert not found[~written.visible].any()
    assert (back.source, back.simulated) == (" ".join(source.splitlines()), simulated)


FREED = Registration(turn=1.5, shift=0.2, scale=0.004)


@pytest.mark.parametrize("clicked", [True, False])
@pytest.mark.parametrize(("pressed", "drawn"), [(FIXED, FIXED), (FREED, FIXED), (HAND_HELD, FREE)])
def test_how_well_the_pictures_are_known_is_read_back(tmp_path, clicked, pressed, drawn):
    path = tmp_path / "markers.csv"
    deviations = np.full((5, 2), 0.3 if clicked else 0.001)
    write_measurements(
        path, replace(observations(), standard_deviations=deviations, pressed=pressed, drawn=drawn)
    )
    back = read_measurements(path, marker_radius=0.6)
    assert (back.pressed, back.drawn) == (pressed, drawn)


@pytest.mark.parametrize(
    ("mark", "deviation", "known"),
    [
        ("", 0.3, HAND_HELD),
        ("", 0.01, FIXED),
        ("", 0.0, FIXED),  # none was given
        ("# simulated", 0.3, FIXED),
        ("# Pressed picture: fixed", 0.3, FIXED),
    ],
)
def test_points_that_were_clicked_have_a_pressed_picture_by_hand(tmp_path, mark, deviation, known):
    lines = [mark, f"{HEADER},std_u_mm,std_v_mm", f"1,2,3,4,{deviation},{deviation}"]
    found = read(tmp_path, "\n".join(lines))
    assert (found.pressed, found.drawn) == (known, FIXED)
    assert ("the pressed picture's frame is known to turn 5 deg" in found.origin) == (known == HAND_HELD)


def test_columns_may_be_in_any_order_among_others(tmp_path):
    found = read(tmp_path, "v_mm,note,visible,x_mm,u_mm,y_mm\n-2,left,1.0,9,0.5,-1\n")
    assert (found.points.tolist(), found.displacements.tolist()) == ([[9, -1]], [[0.5, -2]])


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize(
    "content",
    [
        'x_mm,y_mm,u_mm,v_mm,note\n1,2,3,4,"a,\nb"\n5,6,7,8,c\n',  # at the end of a row
        'note,x_mm,y_mm,u_mm,v_mm\n"a ""b""\n\nc",1,2,3,4\nd,5,6,7,8\n',  # at its start, an empty line
        '"x_mm",y_mm,u_mm,v_mm,"note\n(by hand)"\n1,2,3,4,\n5,6,7,8,\n',  # in the header
        '"# source: a, b\nsecond line",,\nx_mm,y_mm,u_mm,v_mm\n1,2,3,4\n5,6,7,8\n',  # in a comment
        '# 5" ruler\nx_mm,y_mm,u_mm,v_mm\n1,2,3,4\n5,6,7,8\n',  # no quotation
    ],
)
def test_a_line_break_within_quotation_marks_ends_no_row(tmp_path, content, end):
    found = read(tmp_path, content.replace("\n", end))
    assert found.points.tolist() == [[1, 2], [5, 6]]
    assert found.displacements.tolist() == [[3, 4], [7, 8]]


@pytest.mark.parametrize(
    ("seen", "hidden"),
    [("True", "False"), ("TRUE", "FALSE"), ("yes", "No"), ("1.0", "0.0"), ("1", "0"), ("WAHR", "FALSCH")],
)
@pytest.mark.parametrize("cell", ["", "nan", "-", "3.5"])
def test_what_stands_at_an_unseen_marker_is_not_read(tmp_path, seen, hidden, cell):
    lines = [f"{HEADER},std_u_mm,visible", f"1,2,3,4,0.1,{seen}", f"5,6,{cell},{cell},{cell},{hidden}"]
    found = read(tmp_path, "\n".join(lines))
    assert found.visible.tolist() == [True, False]
    assert found.displacements.tolist() == [[3, 4], [0, 0]]
    assert found.standard_deviations.tolist() == [[0.1, 0], [0, 0]]


@pytest.mark.parametrize("cell", ["", "NaN", "nan", "N/A", "#N/A", "None", " "])
def test_a_marker_without_displacement_was_not_seen(tmp_path, cell):
    found = read(tmp_path, f"{HEADER},std_u_mm\n1,2,3,4,0.1\n5,6,{cell},{cell},{cell}\n")
    assert found.visible.tolist() == [True, False]
    assert found.displacements.tolist() == [[3, 4], [0, 0]]


def test_comments_and_blank_lines_may_stand_anywhere(tmp_path):
    content = f"\n# of May\n  # indented\n{HEADER}\n#1,2,3,4\n9,-1,0,0\n\n,,,\n# source: late\n"
    found = read(tmp_path, content)
    assert (len(found.points), found.source) == (1, "late")


@pytest.mark.parametrize(
    "mark", ["# simulated", "#simulated", "#  Simulated ", "# simulated,,,", '"# simulated",,,']
)
def test_the_mark_of_simulated_numbers_is_not_lost(tmp_path, mark):
    assert read(tmp_path, f"{mark}\n{HEADER}\n9,-1,0,0\n").simulated


@pytest.mark.parametrize(("comma", "point"), [(",", "."), (";", ",")], ids=["English", "German"])
def test_a_spreadsheet_may_save_the_file(tmp_path, comma, point):
    """With its byte-order mark, line ends, quoted comments and rows filled up with commas or semicolons."""
    path = tmp_path / "markers.csv"
    written = observations(source=f"fem{comma} finite strain", simulated=True)
    write_measurements(path, written)
    lines = path.read_text().splitlines()
    saved = [lines[0] + comma * 7, f'"{lines[1]}"' + comma * 7]
    saved += [line.replace(",", comma).replace(".", point) for line in lines[2:]]
    back = read(tmp_path, "\ufeff" + "\r\n".join(saved))
    np.testing.assert_array_equal(back.displacements, written.displacements)
    assert (back.source, back.simulated) == (written.source, True)
