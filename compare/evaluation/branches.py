"""Branches of equilibrium: a load may have several stable ones, and two solvers may find two of them."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from pinnray.comparison.evaluation.certificate import ROUNDING
from pinnray.comparison.evaluation.differences import FieldDifference
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.runtime.tables import percent
from pinnray.solvers.problem import Problem
from pinnray.solvers.registry import MissingLibraryError, make_solver

if TYPE_CHECKING:
    from pinnray.solvers.fem.finite_strain.solver import Equilibrium

UNLIKE = 0.01
"""Relative L2 difference of displacements, beyond the stated errors, that needs an explanation: the networks'
criterion of convergence."""


@dataclass(frozen=True, eq=False)
class _Branch:
    """A stable equilibrium, and the names of the solvers that found it."""

    equilibrium: "Equilibrium"
    solvers: list[str]

    @property
    def name(self) -> str:
        return " and ".join(self.solvers)

    @property
    def energy(self) -> float:
        return self.equilibrium.energy


def with_branches(evaluations: Sequence[Evaluation], problem: Problem) -> tuple[list[Evaluation], list[str]]:
    """Add a sentence to evaluations on different branches of equilibrium; and return remarks on the branches.

    Where two converged results of one law of finite strain differ by more than they say, Newton's method goes
    on from each on the finite elements of `fem-nonlinear`. If it ends in several stable equilibria, their
    energies there say which one is the least; the prescribed motion does no other work. A found contact, a
    body in three dimensions and solvers that were given markers are left out.
    """
    judged, remarks = {evaluation.solver: evaluation for evaluation in evaluations}, []
    comparable = [
        each
        for each in evaluations
        if each.law != "linear" and each.converged and each.finite and not (each.in_sample or each.solid)
    ]
    for law in dict.fromkeys(evaluation.law for evaluation in comparable):
        some = [evaluation for evaluation in comparable if evaluation.law == law]
        if problem.load.kind == "cylinder" or not any(_unlike(*pair) for pair in combinations(some, 2)):
            continue
        own = replace(problem, material=problem.material.model_copy(update={"law": law}))
        branches, lost = _branches(some, own)
        if lost:
            remarks.append(
                "results differ by more than they say, and no stable equilibrium was found on the elements "
                f"of fem-nonlinear beside {' and '.join(lost)}: whether this load has several is open"
            )
        if len(branches) < 2:
            continue
        for branch in branches:
            for name in branch.solvers:
                message = f"{judged[name].message.rstrip('. ')}; {_place(branch, branches)}"
                judged[name] = replace(judged[name], message=message)
        parts = [f"{branch.name} {branch.energy:.5g} N mm/mm" for branch in branches]
        remarks.append(
            f"{len(branches)} stable equilibria under this load (the finger buckles): {', '.join(parts)}, by "
            "the elements of fem-nonlinear; what these results differ by is no error of either"
        )
    return list(judged.values()), remarks


def _unlike(first: Evaluation, second: Evaluation) -> bool:
    """Whether displacements differ by more than both results say."""
    stated = [each.uncertainty.displacement.rel_l2 for each in (first, second) if each.uncertainty]
    difference = FieldDifference.of(second.displacement, first.displacement, first.weights)
    return difference.rel_l2 > UNLIKE + sum(stated)


def _branches(evaluations: Sequence[Evaluation], problem: Problem) -> tuple[list[_Branch], list[str]]:
    """The stable equilibria beside results, from the least energy up; names of results that have none."""
    try:
        make_solver("fem-nonlinear")
    except MissingLibraryError as error:
        warnings.warn(f"results differ, and nobody looks for branches: {error}", stacklevel=2)
        return [], []
    from pinnray.solvers.fem.finite_strain.solver import equilibria_near

    starts = [np.concatenate([entry.node_displacement, entry.edge_displacement]) for entry in evaluations]
    branches: list[_Branch] = []
    lost = []
    for evaluation, found in zip(evaluations, equilibria_near(problem, starts), strict=True):
        if found is None or found.unstable:
            lost.append(evaluation.solver)
            continue
        for branch in branches:
            other = branch.equilibrium.nodal
            # Newton's method ends four orders of magnitude below this.
            if np.linalg.norm(found.nodal - other) < 1e-4 * np.linalg.norm(other):
                branch.solvers.append(evaluation.solver)
                break
        else:
            branches.append(_Branch(found, [evaluation.solver]))
    return sorted(branches, key=lambda branch: branch.energy), lost


def _place(branch: _Branch, branches: Sequence[_Branch]) -> str:
    """A clause on a branch among others, the first of which has the least energy."""
    least = branches[0]
    excess = (branches[1] if branch is least else branch).energy / least.energy - 1
    more = "no more energy" if excess < ROUNDING else f"{percent(excess, 2)} more energy"
    if branch is least:
        others = ", ".join(other.name for other in branches[1:])
        return f"of several stable equilibria the one of least energy; that of {others} has {more}"
    return (
        f"NOT THE EQUILIBRIUM OF LEAST ENERGY: it is stable, but has {more} than another stable one, which "
        f"{least.name} found"
    )
