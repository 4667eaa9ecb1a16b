"""The benchmark: its references, broken claims, entries, resumption, the page and what is refused."""

import json
from dataclasses import dataclass, replace

import numpy as np
import pytest

import pinnray as pr
from benchmarks.entries.references import packed
from pinnray.cli import main
from pinnray.options.shared import SolverOptions
from pinnray.runtime.errors import UserError
from pinnray.solvers.fem.linear import FemSolver
from pinnray.studies.benchmark import benchmark
from pinnray.studies.benchmark.benchmark import BenchmarkJob, run_benchmark
from pinnray.studies.benchmark.entry import Entry, load_entries
from pinnray.studies.benchmark.page import COLUMNS, figure_texts
from pinnray.studies.benchmark.problems import problem_set
from pinnray.studies.benchmark.references import STEPS, Reference, unpacked
from pinnray.studies.benchmark.scores import figures
from pinnray.studies.sweep import sweep
from tests.solvers.plugin.pinnray_skfem import SkfemSolver
from tests.studies.benchmark.liars import Scaled

MEAN = problem_set("small").problems[0]


@pytest.fixture
def two(monkeypatch):
    """A set of two problems, of which `fem` and `Scaled` can do the first only."""
    whole = problem_set("small")
    chosen = replace(
        whole, problems=[each for each in whole.problems if each.name in ("default-mean", "default-cylinder")]
    )
    monkeypatch.setattr(benchmark, "problem_set", lambda _: chosen)
    return chosen


def test_every_reference_is_known_well_enough():
    for problem in problem_set("full").problems:
        reference = Reference.load(problem)
        assert reference.bounds["displacement"] < 1e-3, problem.name
        assert reference.bounds["von_mises_away"] < 0.04, problem.name
        assert reference.bounds["force"] < 5e-3, problem.name
        assert 0.1 < reference.away.mean() < 0.8


def test_another_program_is_near_the_reference_by_what_its_own_elements_lack():
    """Of P2 on the shared mesh 0.08 %, 1.3 % and 1.3 %, as of `fem`; a tenth of it bounds the reference."""
    found = figures(SkfemSolver().solve(MEAN.made()), reference := Reference.load(MEAN))
    for name, most in {"displacement": 1e-3, "von_mises_away": 0.02, "force": 0.02}.items():
        assert 0 < found[name] < most
    assert reference.bounds["displacement"] < 0.1 * found["displacement"]
    assert reference.bounds["force"] < 0.1 * found["force"]
    assert found["broken"] == []


def test_packed_values_are_within_half_a_step():
    values = np.random.default_rng(0).normal(size=(50, 2))
    assert np.abs(unpacked(*packed(values)) - values).max() <= 0.5001 * np.ptp(values) / STEPS


@pytest.mark.parametrize(
    ("solver", "words"),
    [
        (Scaled(), []),  # honest
        (
            Scaled(1.07),
            ["off by 0.07 (limit 0.05), force is off", "error estimated at", "contact misses"],
        ),  # wrong, and sure of itself
        (Scaled(1.07, estimate=100.0, converged=False), ["contact misses"]),  # wrong, and says so
        (Scaled(estimate=0.1), ["error estimated at"]),  # right, but not as right as it says
        (Scaled(0.97, estimate=100.0), ["below the least", "contact misses"]),  # less than there can be
        (Scaled(shift=0.1, estimate=100.0), ["base moves by 0.14 mm", "mean displacement by 0.14 mm"]),
    ],
)
def test_claims_that_are_not_true_are_found(solver, words):
    broken = figures(solver.solve(MEAN.made()), Reference.load(MEAN))["broken"]
    assert len(broken) == len(words)
    assert all(word in claim for word, claim in zip(words, broken, strict=True))


def test_a_run_keeps_its_rows_and_goes_on(tmp_path, two, monkeypatch):
    @dataclass(frozen=True)
    class Own(Scaled):  # of a script: no other process can import it
        name = "own"

    job = BenchmarkJob(solvers=[FemSolver(), Own(), Scaled(0.0)], out=tmp_path)
    first = run_benchmark(job)
    states = {(row["entry"], row["problem"]): row["state"] for _, row in first.table().iterrows()}
    assert states["own", "default-mean"] == "done"
    assert states["own", "default-cylinder"] == states["fem", "default-cylinder"] == "refused"
    assert states["scaled", "default-mean"] == "failed"
    failed = first.entries[2].rows[0]
    assert "ZeroDivisionError: no factor" in failed.message
    assert failed.displacement is None
    fem = first.entries[0].rows[0]
    assert 0.3 < fem.times_fem < 3  # of itself, on a busy machine
    assert 0.05 < fem.memory < 10

    monkeypatch.setattr(benchmark, "score", None)  # nothing is solved again
    assert run_benchmark(replace(job, solvers=[FemSolver()])).entries[0].rows == first.entries[0].rows


def test_a_solver_that_takes_too_long_has_a_row(tmp_path, two, monkeypatch):
    monkeypatch.setattr(sweep, "GRACE_S", 0.0)
    monkeypatch.setattr(benchmark, "_unit_times", lambda *_: {})
    found = run_benchmark(BenchmarkJob(solvers=[Scaled(wait_s=60)], out=tmp_path, time_limit=3.0))
    assert found.entries[0].rows[0].state == "out of time"
    assert found.entries[0].rows[0].message == "stopped at the time limit: after 3 s, of 3 s"
    assert "no multiples" in found.remarks[0]


def test_an_entry_is_a_file_and_those_of_other_sets_are_left_out(tmp_path, two):
    found = pr.benchmark([Scaled(1.07)], entries=None, out=tmp_path / "out")
    page = (tmp_path / "out" / "benchmark.html").read_text()
    assert page.index("Claims that are not true") < page.index("Medians over")
    assert "scaled: says so" not in page
    assert len(repr(found)) < 300
    (entry,) = found.entries
    assert Entry.load(tmp_path / "out" / "entries" / "scaled-small.json") == entry
    replace(entry, label="old", problems={**entry.problems, "version": 0}).save(tmp_path)
    entry.save(tmp_path)
    fitting, remarks = load_entries(tmp_path, two)
    assert fitting == [entry]
    assert remarks == ["left out, since they are of another version of the set small: old-small.json"]
    (tmp_path / "bad.json").write_text(json.dumps({"label": "bad"}))
    with pytest.raises(UserError, match=r"bad.json is no entry of the benchmark: settings"):
        load_entries(tmp_path, two)


def test_what_the_reference_does_not_tell_apart_is_marked():
    blank = dict.fromkeys(name for name, _ in COLUMNS.values())
    rows = [blank | {"force": 0.02}, blank | {"force": -0.025}, blank]
    force = list(COLUMNS).index("force,\n%")
    for bound, said in {0.006: ["0.60", "+2.0 ≈", "−2.5 ≈"], 0.004: ["0.40", "+2.0", "−2.5"]}.items():
        assert [row[force] for row in figure_texts(rows, {"force": bound})] == [*said, "–"]


def test_a_result_that_did_not_converge_is_told(tmp_path, two, capsys, monkeypatch):
    line = ["benchmark", "--out", str(tmp_path)]
    for solver, code in ((Scaled(), 0), (Scaled(converged=False), 2)):
        monkeypatch.setattr(SolverOptions, "read", lambda *_, solver=solver: [solver])
        assert main(line) == code
    assert f"{tmp_path} holds an entry of scaled with other settings" in capsys.readouterr().err
    other = tmp_path / "other"
    assert main([*line[:2], str(other)]) == 3
    assert "scaled: says so" in (other / "benchmark.html").read_text()
    medians = pr.benchmark([Scaled(converged=False)], out=other).medians()
    assert medians[["solved", "converged"]].to_numpy().tolist() == [[1, 0]]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("fem --problems large", "no set of problems is called 'large'; there are small and full"),
        ("fem,fem", "name each solver once"),
        ("fem --entries nowhere", "there is no folder nowhere of entries"),
    ],
)
def test_what_cannot_be_run_is_refused_in_one_line(line, words, tmp_path, capsys):
    assert main(["benchmark", *line.split(), "--out", str(tmp_path / "out")]) == 2
    assert words in capsys.readouterr().err
