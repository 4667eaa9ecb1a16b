"""The force of one run is the same number everywhere that it is told."""

import json
import re
from math import hypot
from pathlib import Path

import pytest

import pinnray as pr
from benchmarks.results.default_run import figures_of, short_table
from pinnray.cli import main
from pinnray.runtime.tables import number, percent

pytestmark = pytest.mark.usefixtures("few_elements_throughout", "in_line", "without_pictures")


def test_tables_report_metrics_terminal_and_sweep_tell_one_force(tmp_path: Path, capsys) -> None:
    out = tmp_path / "run"
    main(["compare", "--solvers", "fem,fem-asm", "--mesh-size", "2", "--out", str(out)])
    terminal = capsys.readouterr().out
    told = json.loads((out / "metrics.json").read_text(encoding="utf-8"))
    own, depth, truth = told["solvers"]["fem"], told["design"]["depth"], told["truth"]["values"]["force_N"]
    force, size = own["figures"]["values"]["force_N"], depth * hypot(*own["reaction"])
    said, by_size = (percent(value / truth - 1, 2, plus=True) for value in (force, size))
    assert said != by_size, "the two are too near to be told apart"
    assert force == pytest.approx(-depth * own["reaction"][1])
    assert own["force_to_truth_rel"] == pytest.approx(force / truth - 1)
    assert short_table([figures_of("fem", own)]).split("|")[-2].split() == said.split()
    (row,) = (line for line in re.findall(r"^ *fem  .*", terminal, re.M) if said.split()[0] in line.split())
    assert by_size.split()[0] not in row.split()
    report = (out / "report.html").read_text(encoding="utf-8")
    assert f"the force is {number(force, 3)} N (truth {number(truth, 3)})" in report
    assert said in report
    assert by_size not in report
    main(["solve", "fem", "--mesh-size", "2", "--out", str(tmp_path / "fem.vtu")])
    assert re.search(rf"^force +{force:.4g} N", capsys.readouterr().out, re.M)
    assert pr.sweep({"E": [11.4]}, size=2.0)["force_N"][0] == pytest.approx(force, rel=1e-9)
