"""Several finished runs side by side: `pinnray report`."""

import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from PIL import Image

from pinnray.cli import main
from pinnray.comparison.report.output_files import metrics
from pinnray.comparison.report.runs import differing_settings, read_runs
from pinnray.runtime.atomic import write_json
from pinnray.solvers.solution import Estimated, IdentifiedForce
from tests.compare.tables import rows_of

Save = Callable[..., Path]


@pytest.fixture
def save(compared, estimated, evaluate, tmp_path) -> Save:
    """`save(name, scale, seed)`: the folder of a run with a network and a solver that was given markers."""

    def make(name: str, scale: float = 1.005, seed: int = 0) -> Path:
        given = replace(evaluate("fem-asm", scale), in_sample=True, left_out=estimated.marker_displacement)
        comparison = compared(estimated, evaluate("pinn-std", scale), given)
        folder = tmp_path / name
        write_json(folder / "metrics.json", metrics(comparison))
        write_json(folder / "run.json", {"seed": {"pinn-std": seed}, "left_out": {"gp": "too slow"}})
        (folder / "figures").mkdir()
        Image.new("RGB", (4, 3), "red").save(folder / "figures" / "overlay.png")
        return folder

    return make


def test_one_run_gives_its_answers(save: Save, capsys: pytest.CaptureFixture[str]) -> None:
    folder = save("first")
    assert main(["report", str(folder)]) == 0
    said = capsys.readouterr().out
    assert "May the network be trusted here?\n  Yes, as a solver" in said
    assert "gp was left out: too slow." in said
    assert said.endswith(f"report: {folder / 'report.html'}\n")
    assert [path.name for path in folder.parent.iterdir()] == ["first"]


def test_several_runs_are_one_page_and_one_table(save: Save, tmp_path: Path) -> None:
    runs = [save("first"), save("second", 1.1, seed=7)]
    assert main(["report", *map(str, runs), "--out", str(tmp_path / "both")]) == 0
    rows = rows_of(tmp_path / "both" / "runs.csv")
    assert [(row["run"], row["solver"]) for row in rows] == [
        (run, solver) for run in ("first", "second") for solver in ("fem", "pinn-std", "fem-asm")
    ]
    assert [row["given_mae_u_mm"] == "" for row in rows] == 2 * [True, True, False]
    assert float(rows[4]["to_reference_displacement_rel_l2"]) == pytest.approx(0.1)
    html = (tmp_path / "both" / "runs.html").read_text(encoding="utf-8")
    assert html.count("data:image/png") == 2
    assert re.findall(r"<script src|<link|https?://", html) == []
    assert "simulated" in html


def test_what_differs_between_runs_is_named(save: Save) -> None:
    runs = read_runs([save("first"), save("second", seed=7)])
    assert differing_settings(runs).rows == [["seed pinn-std", "0", "7"]]


def test_runs_of_one_name_are_told_apart_by_their_paths(save: Save) -> None:
    folders = [save("a/run"), save("b/run")]
    assert [run.name for run in read_runs(folders)] == [str(folder) for folder in folders]


def without_numbers(value):
    """The content with null for every number."""
    if isinstance(value, dict):
        return {key: without_numbers(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [without_numbers(entry) for entry in value]
    return None if isinstance(value, float) else value


@pytest.fixture
def truthful(save, compared, estimated, evaluate, finished) -> Path:
    """A run with a truth, a found force and its place, and figures."""
    folder = save("truthful")
    given = evaluate("fem-asm", 1.02)
    force = IdentifiedForce(Estimated(0.5, 0.4, 0.8), Estimated(36.0, 35.0, 37.5))
    given = replace(given, in_sample=True, left_out=estimated.marker_displacement, identified=force)
    network = evaluate("pinn-asm", 1.01)
    network = replace(network, in_sample=True, left_out=estimated.marker_displacement, twin="fem-asm")
    plain, truth = evaluate("pinn-std", 1.05), evaluate("fem-nonlinear", 1.1)
    content = metrics(compared(estimated, plain, network, given, truth=truth))
    figures = json.loads((finished / "metrics.json").read_text(encoding="utf-8"))["solvers"]["fem"]["figures"]
    figures["values"] |= {"force_low_N": 4.0, "force_high_N": 5.0, "strain_over_break": 0.8}
    for own in content["solvers"].values():
        own["figures"] = figures
    write_json(folder / "metrics.json", content)
    return folder


@pytest.mark.parametrize("solvers", [["fem"], ["pinn-std"], ["pinn-asm"], ["fem-asm"], None])
def test_a_number_that_is_null_is_no_number(truthful, capsys, solvers):
    """A number that is not finite is null in JSON: here all numbers of one solver, and of all."""
    content = json.loads((truthful / "metrics.json").read_text(encoding="utf-8"))
    for name in solvers or content["solvers"]:
        content["solvers"][name] = without_numbers(content["solvers"][name])
    write_json(truthful / "metrics.json", content)
    assert main(["report", str(truthful)]) == 0
    both = truthful.parent / "both"
    copy = shutil.copytree(truthful, truthful.parent / "copy")
    assert main(["report", str(truthful), str(copy), "--out", str(both)]) == 0
    words = [capsys.readouterr().out, *(path.read_text("utf-8") for path in both.iterdir())]
    for text in words:
        assert not re.search(r"\b(nan|None|inf)\b", text)
    rows = [row for row in rows_of(both / "runs.csv") if row["solver"] in (solvers or row["solver"])]
    assert {row["force_N_per_mm"] for row in rows} == {""}


@pytest.mark.slow
def test_each_number_alone_may_be_null(truthful):
    content = json.loads((truthful / "metrics.json").read_text(encoding="utf-8"))

    def holders(value):
        entries = value.items() if isinstance(value, dict) else enumerate(value[:1])
        for key, entry in entries:
            if isinstance(entry, dict | list):
                yield from holders(entry)
            elif isinstance(entry, float):
                yield value, key, entry

    for holder, key, number in holders(content["solvers"]):
        holder[key] = None
        write_json(truthful / "metrics.json", content)
        (run,) = read_runs([truthful])
        assert not re.search(r"\bnan\b", str([[a.verdict, a.sentences, a.table] for a in run.answers]))
        holder[key] = number


@pytest.mark.parametrize(
    ("solver", "key", "value"),
    [("pinn-std", "to_reference", None), ("pinn-std", "energy", "1.1"), ("fem-asm", "markers", [])],
)
def test_a_run_that_lacks_a_number_is_one_line(save, capsys, solver, key, value):
    folder = save("first")
    content = json.loads((folder / "metrics.json").read_text(encoding="utf-8"))
    content["solvers"][solver][key] = value
    write_json(folder / "metrics.json", content)
    assert main(["report", str(folder)]) == 2
    assert "metrics.json is damaged: a number is missing" in capsys.readouterr().err
