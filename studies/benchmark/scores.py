"""One solver on one problem: its errors, what it costs, and whether what it claims is true."""

import resource
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pinnray.runtime.errors import UserError
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.solvers.problem import contact_functional
from pinnray.solvers.solution import SolidField, Solution
from pinnray.solvers.solver import Solver, Traits, UnsupportedProblemError, check_problem, solved
from pinnray.studies.benchmark.problems import BenchmarkProblem
from pinnray.studies.benchmark.references import Reference, Sampled
from pinnray.studies.sweep.measurement import Ending, Measurement

USABLE = {"displacement": 0.05, "force": 0.05, "von_mises_away": 0.1}
"""Largest errors of a result that says it has converged: a designer would take it for granted."""
ESTIMATED = 2.0
"""Largest true error over the error that the solver estimates."""
MISSED_ENERGY = 0.02
"""Largest share of the energy by which a result may be below the least: then its quadrature misses some."""
CONDITIONS = 1e-3
"""Largest deviation at base and contact over the stroke, by which the force is then off in proportion."""
QUICK_S = 5.0
"""CPU time up to which a solve is repeated, s: the first one in a process also loads libraries."""
REPEATS = 3


@dataclass(frozen=True)
class BenchmarkTask:
    """A solver and a problem, as a process gets them.

    Attributes:
        name: In the journal.
        solver: The solver.
        problem: The problem.
        compared: Whether with its reference; else only the time counts.
    """

    name: str
    solver: Solver
    problem: BenchmarkProblem
    compared: bool = True


def score(task: BenchmarkTask, _report: Callable[..., None]) -> list[Measurement]:
    """Solve a problem and compare it: one measurement, whatever goes wrong."""
    started = time.perf_counter()
    state: Ending
    values: dict[str, Any] = {}
    try:
        solution, values = _solved(task)
        if task.compared:
            values |= figures(solution, Reference.load(task.problem))
        state = "done" if solution.status.converged else "not converged"
        said = solution.status.message
    except UnsupportedProblemError as error:
        state, said = "refused", str(error)
    except UserError as error:
        state, said = "failed", str(error)
    return [Measurement(task.name, state, " ".join(said.split()), time.perf_counter() - started, values)]


def figures(solution: Solution, reference: Reference) -> dict[str, Any]:
    """Errors by `MEASURES`, deviations at base and contact, what was claimed, and what of it is not true."""
    errors = reference.errors(Sampled.of(solution, reference.points))
    claimed, stroke = claims(solution), float(np.linalg.norm(solution.problem.load.values))
    off = missed(solution)
    broken = broken_claims(solution, errors, claimed, reference)
    broken += [MISSED[name].format(each) for name, each in off.items() if not each <= CONDITIONS * stroke]
    return {
        **errors,
        **{name: each / stroke for name, each in off.items()},
        "claimed": claimed,
        "broken": broken,
    }


def missed(solution: Solution) -> dict[str, float]:
    """Largest displacement of the base, and what the mean at the contact lacks to the load's, if any, mm."""
    problem, load = solution.problem, solution.problem.load
    space = LagrangeSpace(problem.mesh, 2)
    base = solution.displacement(space.nodes[space.boundary_nodes("base")])
    off = {"base": float(np.linalg.norm(base, axis=1).max())}
    if load.kind in ("mean", "patch"):
        points, weights = contact_functional(problem)
        mean = weights @ solution.displacement(points)
        off["contact"] = float(np.linalg.norm(mean[load.prescribed] - load.values))
    return off


MISSED = {
    "base": "the base moves by {:.2g} mm",
    "contact": "the contact misses the mean displacement by {:.2g} mm",
}


def claims(solution: Solution) -> dict[str, float | bool]:
    """What a solver says of its result: whether it converged, and its errors as far as it estimates them."""
    said: dict[str, float | bool] = {"converged": bool(solution.status.converged)}
    if solution.error is not None:
        said |= {"displacement": solution.error.displacement, "von_mises": solution.error.von_mises}
    elif len(column := solution.history.get("estimated_error", np.empty(0))):
        said["displacement"] = float(column[-1])
    return said


def broken_claims(
    solution: Solution, errors: dict[str, float], claimed: dict[str, float | bool], reference: Reference
) -> list[str]:
    """Claims that the reference disproves, a clause each; its own error is taken off before."""
    found = []
    least = {name: abs(value) - reference.bounds[name] for name, value in errors.items()}
    off = [
        f"{WORDS.get(name, name)} is off by {abs(errors[name]):.2g} (limit {most:g})"
        for name, most in USABLE.items()
        if not least[name] <= most
    ]
    if claimed["converged"] and off:
        found.append(f"said to have converged, but {', '.join(off)}")
    for name in ("displacement", "von_mises"):
        if name in claimed and not least[name] <= ESTIMATED * claimed[name]:
            said = f"error estimated at {claimed[name]:.2g}, in truth {errors[name]:.2g}"
            found.append(f"{WORDS.get(name, name)}: {said}")
    if not solution.problem.load.friction and errors["energy"] + reference.bounds["energy"] < -MISSED_ENERGY:
        found.append(f"energy {-errors['energy']:.2g} below the least that any displacement has")
    return found


WORDS = {"von_mises": "von Mises stress", "von_mises_away": "von Mises stress away from corners"}


def _solved(task: BenchmarkTask) -> tuple[Solution, dict[str, float]]:
    """The solution, the least processor time of a few solves where they are quick, s, and the memory, GB."""
    problem, times = task.problem.made(), list[float]()
    if Traits.of(task.solver).assimilates:
        raise UnsupportedProblemError(f"{task.solver.name} fits markers, and the problems have none")
    check_problem(task.solver, problem)
    with suppress(OSError):  # elsewhere than on Linux the peak is that of the process's whole life
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    while len(times) < REPEATS and sum(times) < QUICK_S:
        started = time.process_time()
        solution = solved(task.solver, problem)
        times.append(time.process_time() - started)
    if isinstance(solution.field, SolidField):
        raise UnsupportedProblemError(
            f"{task.solver.name} solves a body in three dimensions, and the problems are plane"
        )
    return solution, {"seconds": min(times), "memory": peak_memory_gb()}


def peak_memory_gb() -> float:
    """Most memory that this process had at a time, libraries included, GB."""
    status = Path("/proc/self/status")  # Linux
    for line in status.read_text(encoding="ascii").splitlines() if status.exists() else ():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) * 1024 / 1e9
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9
