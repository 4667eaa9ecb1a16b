"""`pinnray sensitivity`: the table in the terminal, the CSV file and the picture."""

import csv

import pytest

from pinnray.cli import main

pytestmark = pytest.mark.usefixtures("few_elements_throughout")

COARSE = ["sensitivity", "--mesh-size", "2", "--stroke", "4"]


@pytest.mark.slow
def test_the_command_writes_table_and_picture(tmp_path, capsys):
    out = tmp_path / "found.csv"
    assert main([*COARSE, "--figure", "wrap", "--out", str(out)]) == 0
    said = capsys.readouterr().out
    (force,) = (line for line in said.splitlines() if line.startswith("force "))
    assert "±" in force
    assert "stroke +1" in force or "young +1" in force  # in proportion to either
    with out.open() as file:
        rows = {row["parameter"]: row for row in csv.DictReader(file)}
    assert rows["young"]["unit"] == "MPa"
    assert float(rows["young"]["force"]) * float(rows["young"]["value"]) == pytest.approx(
        float(rows["stroke"]["force"]) * 4.0
    )
    assert out.with_suffix(".png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_a_force_on_the_way_is_refused_where_it_is_not_in_proportion_to_the_load(tmp_path, capsys):
    law = ["--law", "neo-hookean", "--out", str(tmp_path / "found.csv")]
    assert main([*COARSE, *law, "--figure", "force_25"]) == 2
    assert "not known at the full load alone" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
