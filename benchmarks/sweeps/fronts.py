"""`pinnray optimise` against NSGA-II with as many runs of the solver, and no emulator.

NSGA-II with 120 finite-element runs, here six generations of 20, is a published practice for Fin Ray fingers.
The question is `docs/examples/wrap.toml`, with all walls and the tip varied. Three seeds; the
hypervolume counts from one point for all. Allow ten minutes on two cores.
"""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.optimize import minimize
from rich.table import Table

from compare.runtime.tables import terminal_table
from geometry.arrays import FloatArray
from studies.optimum.front import hypervolume, reference_point
from studies.optimum.question import Limit, Question
from studies.optimum.search import search_front
from studies.sweep.job import StudyJob
from studies.sweep.measurement import Measurement, measured
from studies.sweep.sampling import sample_at

RUNS, GENERATION = 120, 20
SEEDS = (0, 1, 2)
VARIED = {
    "rib_count": {"from": 2, "to": 8},
    "rib_angle": {"from": -20, "to": 40},
    "rib_thickness": {"from": 0.8, "to": 2.5},
    "front_thickness": {"from": 0.8, "to": 2.5},
    "back_thickness": {"from": 0.8, "to": 2.5},
    "tip_length": {"from": 14, "to": 26},
}


def question(seed: int) -> Question:
    """Most wrap and most force, printable and not overstressed."""
    return Question(
        name="fronts",
        mesh_size=1.0,
        samples=RUNS // 3,
        seed=seed,
        fixed={"marker_diameter": 0.4, "contact_position": 35.0},
        varied=VARIED,
        objectives={"wrap": "largest", "force": "largest"},
        constraints={"von_mises": Limit(at_most=1.5), "narrowest_gap": Limit(at_least=0.8)},
        runs=RUNS,
    )


def main() -> Table:
    """Run both for every seed and compare their hypervolumes."""
    results = {}
    for seed in SEEDS:
        asked = question(seed)
        with tempfile.TemporaryDirectory() as folder:
            ours = search_front(StudyJob(asked, Path(folder), Path(folder) / "out", 2)).measurements
        results[seed] = _costs(asked, ours), _costs(asked, by_nsga2(asked))
    reference = reference_point(np.concatenate([costs for pair in results.values() for costs in pair]))
    rows = []
    for seed, pair in results.items():
        ours, theirs = (hypervolume(costs, reference) for costs in pair)
        rows.append((str(seed), f"{ours:.2f}", f"{theirs:.2f}", f"{ours / theirs:.2f}"))
    header = ("seed", "pinnray optimise", "NSGA-II", "ratio")
    return terminal_table(f"Hypervolume of the front after {RUNS} runs", header, rows)


def by_nsga2(asked: Question) -> list[Measurement]:
    """Every run of NSGA-II; a finger that cannot be made counts as a run, as it does there."""
    job = StudyJob(asked, Path(), Path() / "out")
    runs: list[Measurement] = []

    class Solved(Problem):  # type: ignore[misc] # pymoo has no annotations
        def _evaluate(self, places: FloatArray, out: dict[str, Any], *_: object, **__: object) -> None:
            costs, excess = [], []
            for row in places:
                found = measured(job.task(len(runs), sample_at(asked, row)))
                runs.append(found)
                done = found.state == "done"
                costs.append(asked.costs(found.values) if done else [1e9] * len(asked.objectives))
                excess.append([0.0, *asked.excesses(found.values)] if done else [1.0, 1e9, 1e9])
            out["F"], out["G"] = np.array(costs), np.array(excess)

    problem = Solved(n_var=len(VARIED), n_obj=2, n_ieq_constr=3, xl=0.0, xu=1.0)
    minimize(problem, NSGA2(pop_size=GENERATION), ("n_eval", RUNS), seed=asked.seed)
    return runs


def _costs(asked: Question, runs: list[Measurement]) -> FloatArray:
    """Costs of the runs that are allowed, shape (n, 2)."""
    good = [each for each in runs if each.state == "done" and asked.allows(each.values)]
    return np.array([asked.costs(each.values) for each in good]).reshape(-1, 2)
