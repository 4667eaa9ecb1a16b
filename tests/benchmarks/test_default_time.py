"""The benchmark of the default run, on a coarse one."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.results.default_time import StageTime

ROOT = Path(__file__).parents[2]
SETTINGS = ("pinn-std.preset=fast", "pinn-std.wall_spacing=1.8", "pinn-std.corner_spacing=0.1")
RUN = [
    *("compare", "--quiet", "--solvers", "fem,pinn-std", "--mesh-size", "2"),
    *(word for setting in SETTINGS for word in ("--solver-set", setting)),
    "--out",
]

PROGRAM = """
from runpy import run_module
from compare.figures.gallery import GALLERY
for name in GALLERY.keys() - {"mesh", "von_mises"}:
    del GALLERY[name]
run_module("benchmarks.results.default_time", run_name="__main__")
"""
"""With two pictures: all take a third of the time."""


@pytest.mark.slow
def test_every_stage_has_what_it_needs_within_its_time(tmp_path: Path) -> None:
    """In a process of its own, as it counts in the functions of the program."""
    answer = tmp_path / "stages.json"
    program = [sys.executable, "-c", PROGRAM, str(answer)]
    subprocess.run([*program, *RUN, str(tmp_path / "out")], cwd=ROOT, check=True)
    rows = {row[0]: StageTime(*row) for row in json.loads(answer.read_text(encoding="utf-8"))}
    assert next(iter(rows)) == "start-up and imports"
    assert {"fem", "pinn-std", "fields", "pictures", "report"} < set(rows)
    assert all(0 <= row.floor <= row.seconds for row in rows.values())
    assert rows["fem"].needs == "1 factorisations"  # which the figures at rest share
    assert "GFlop of products" in rows["pinn-std"].needs
    assert rows["fields"].needs == "3 fields written"  # the truth's, too
