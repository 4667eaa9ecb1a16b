"""Tables as programs and people save them give the same cells, or one line that says what is wrong."""

from pathlib import Path

import pytest

from pinnray.runtime.errors import UserError
from pinnray.runtime.tables import read_table

COLUMNS, FURTHER = {"x": "x", "y": "y"}, {"note": "note"}
PLAIN = "x,y\n1.5,-2\n1040.25,0.5\n"
GERMAN = "x;y\n1,5;-2\n1040,25;0,5\n"


def read(folder: Path, content: str | bytes) -> list[list[float]]:
    path = folder / "table.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    rows = read_table(path, "points", COLUMNS, FURTHER).rows
    return [[float(cells["x"]), float(cells["y"])] for _, cells in rows]


@pytest.mark.parametrize(
    "content",
    [
        PLAIN,
        "\ufeff" + PLAIN,  # Excel's "CSV UTF-8"
        PLAIN.encode("utf-16"),  # its "Unicode text"
        "é, 25 °C\n".encode("cp1252") + PLAIN.encode(),  # its "CSV"
        " x , y \n 1.5 , -2 \n 1040.25 , 0.5 \n",
        '"x","y"\n"1.5", "-2"\n"1040.25","0.5"\n',
        PLAIN.replace(",", ";"),
        PLAIN.replace(",", "\t"),
        GERMAN,
        GERMAN.replace(";", "\t"),
        GERMAN.replace("1040,25", "1.040,25"),
        "x,y,\n1.5,-2,\n1040.25,0.5,\n",  # a separator at the end of every line
        "x,y\n1.5,-2,,\n1040.25,0.5\n",
        "n,X,Y\n1,1.5,-2\n2,1040.25,0.5\n",
        ",x,y\n0,1.5,-2\n1,1040.25,0.5\n",  # an index without a title
        "Specimen;7\nMachine;A\n\nx;y\n1,5;-2\n1040,25;0,5\n",  # a preamble
        "program, version\nx,y\n(mm),[mm]\n1.5,-2\n1040.25,0.5\n",  # and units
        "x,y\nmm\n1.5,-2\n1040.25,0.5\n",  # a unit of the first column only
        "x,y\nmm,mm\n\n# a comment\n1.5,-2\n,\n1040.25,0.5\n",
    ],
)
def test_it_is_one_table_however_it_was_saved(tmp_path, content):
    assert read(tmp_path, content) == [[1.5, -2], [1040.25, 0.5]]


@pytest.mark.parametrize(
    ("content", "cells"),
    [
        ("x;y\n900;1.000\n1.000;800\n", [[900, 1000], [1000, 800]]),  # whole, of German Excel
        ("x\ty\n900\t1,000,000\n1,000\t0\n", [[900, 1e6], [1000, 0]]),  # and of an English one
        ("x;y;note\n0.020;1.000;2,5\n0.500;0.900;3,5\n", [[0.02, 1], [0.5, 0.9]]),  # decimals
        ("x;y\n900,5;1.000\n1,5;800,2\n", [[900.5, 1000], [1.5, 800.2]]),
    ],
)
def test_marks_between_thousands_are_no_decimal_points(tmp_path, content, cells):
    assert read(tmp_path, content) == cells


def test_units_below_the_titles_are_part_of_them(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("x;y\n(mm);(%)\n1,5;2\n")
    table = read_table(path, "points", COLUMNS)
    assert table.titles == {"x": "x (mm)", "y": "y (%)"}


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("x,y\n1,2\n3,4,5\n", "line 3: the header names 2 columns, this line has 3"),
        ("x,y\n1,5,2,5\n", "line 2: the header names 2 columns, this line has 4"),  # decimal commas
        ("x;y\n1,5\n", "line 2: the header names 2 columns, this line has 1"),
        ("x,y,x\n1,2,3\n", "has the column x twice"),
        ("u,v\n1,2\n", "has no column x; the header must name x, y and may name note; it names 'u', 'v'"),
        ("", "it is empty"),
        ("Results\n1,2\nx,z\n1,2\n", "it names 'x', 'z'"),
        (b"PK\x03\x04\0\0", "it is not a CSV file"),  # a workbook
        ('x,y\n1,"2\n', "a quotation mark is opened and not closed"),
    ],
)
def test_what_is_wrong_is_said(tmp_path, content, said):
    with pytest.raises(UserError) as caught:
        read(tmp_path, content)
    assert said in str(caught.value)
