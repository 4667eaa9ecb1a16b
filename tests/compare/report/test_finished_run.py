"""The answers of a finished run, read from its numbers: `pinnray report`."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from pinnray.cli import main
from pinnray.comparison.evaluation.scores import Scores
from pinnray.comparison.report.summary import answers
from pinnray.runtime.atomic import write_json
from pinnray.solvers.solution import Estimated, IdentifiedForce

Save = Callable[..., Path]


@pytest.fixture
def folder(compared, estimated, evaluate, finished, tmp_path) -> Path:
    """A run with a truth, a found force and its place, and figures."""
    given = evaluate("fem-asm", 1.02)
    force = IdentifiedForce(
        Estimated(0.5, 0.4, 0.8),
        Estimated(0.1, 0.0, 0.2),
        Estimated(36.0, 35.0, 37.5),
        {"markers": 0.8, "contact": 0.2},
        "80 % of the variance of the force comes from the errors of the markers.",
    )
    given = replace(given, in_sample=True, left_out=estimated.marker_displacement, identified=force)
    network = evaluate("pinn-asm", 1.01)
    network = replace(network, in_sample=True, left_out=estimated.marker_displacement, twin="fem-asm")
    plain, truth = evaluate("pinn-std", 1.005), evaluate("fem-nonlinear", 1.1)
    comparison = compared(estimated, plain, network, given, truth=truth, unsupported={"gp": "too slow"})
    content = comparison.scores.content()
    figures = json.loads((finished / "metrics.json").read_text(encoding="utf-8"))["solvers"]["fem"]["figures"]
    figures["values"] |= {"force_low_N": 4.0, "force_high_N": 5.0, "strain_over_break": 0.8}
    for own in content["solvers"].values():
        own["figures"] = figures
    write_json(tmp_path / "run" / "metrics.json", content)
    return tmp_path / "run"


def test_a_run_gives_its_answers(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", str(folder)]) == 0
    said = capsys.readouterr().out
    assert "May the network be trusted here?\n  Yes, as a solver" in said
    assert "gp was left out: too slow." in said
    assert "The force acts at x = 36.0 mm (35.0 to 37.5 mm) by fem-asm." in said
    assert "80 % of the variance of the force comes from the errors" in said
    assert re.search(r"fem-asm +0\.700 +7\.3.% ", said)  # the table of the markers
    assert said.endswith(f"report: {folder / 'report.html'}\n")
    assert [path.name for path in folder.iterdir()] == ["metrics.json"]


def test_each_number_may_be_null(folder: Path) -> None:
    """A number that is not finite is null in JSON."""
    content = json.loads((folder / "metrics.json").read_text(encoding="utf-8"))

    def holders(value):
        entries = value.items() if isinstance(value, dict) else enumerate(value[:1])
        for key, entry in entries:
            if isinstance(entry, dict | list):
                yield from holders(entry)
            elif isinstance(entry, float):
                yield value, key, entry

    found = list(holders(content["solvers"]))
    assert len(found) > 200
    for holder, key, number in found:
        holder[key] = None
        scores = Scores.model_validate(content)
        said = str([[each.verdict, each.sentences, each.table or ""] for each in answers(scores)])
        assert not re.search(r"\b(nan|None|inf)\b", said), (key, number)
        holder[key] = number
    for holder, key, _ in found:
        holder[key] = None
    assert answers(Scores.model_validate(content))


@pytest.mark.parametrize(
    ("solver", "key", "value"),
    [("pinn-std", "to_reference", None), ("pinn-std", "energy", "much"), ("fem-asm", "markers", [])],
)
def test_a_run_that_lacks_a_number_is_one_line(folder, capsys, solver, key, value):
    content = json.loads((folder / "metrics.json").read_text(encoding="utf-8"))
    content["solvers"][solver][key] = value
    write_json(folder / "metrics.json", content)
    assert main(["report", str(folder)]) == 2
    assert f"is damaged, or of another program: solvers.{solver}.{key}" in capsys.readouterr().err
