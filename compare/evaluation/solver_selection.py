"""Drops default solvers that do not support the problem."""

from collections.abc import Collection, Mapping, Sequence

from solvers.problem import Load, Material
from solvers.solver import Solver, UnsupportedProblemError, check_load, with_law


def supported_solvers(
    solvers: Sequence[Solver], spare: Collection[str], material: Material, load: Load
) -> tuple[list[Solver], dict[str, str]]:
    """The solvers that take a material and a load, and by name why others are left out.

    Raises:
        UnsupportedProblemError: If one does not that is not among the spare ones, or none does.
    """
    chosen: list[Solver] = []
    left_out: dict[str, str] = {}
    for solver in solvers:
        try:
            check_load(solver, load)
            with_law(material, solver)
            chosen.append(solver)
        except UnsupportedProblemError as error:
            left_out[solver.name] = f"no load {load.kind!r}" if load.kind not in solver.loads else str(error)
            if solver.name not in spare or len(left_out) == len(solvers):
                raise
    return chosen, left_out


def left_out_remarks(left_out: Mapping[str, str]) -> list[str]:
    """A line a reason, with the solvers that it holds for."""
    reasons: dict[str, list[str]] = {}
    for name, reason in left_out.items():
        reasons.setdefault(reason, []).append(name)
    return [f"left out: {', '.join(names)} ({reason})" for reason, names in reasons.items()]
