"""Branches of equilibrium: a load may have several stable ones, and two solvers may find two of them."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from compare.evaluation.certificate import ROUNDING
from compare.evaluation.differences import field_difference
from compare.evaluation.evaluation import Evaluation
from compare.runtime.tables import percent
from solvers.problem import Problem
from solvers.registry import MissingLibraryError, make_solver

if TYPE_CHECKING:
    from solvers.fem.finite_strain.nearby import Equilibrium

ALIKE = 0.01
"""Relative L2 difference of displacements, beyond the stated errors, that needs no explanation: the networks'
criterion of convergence."""
SAME = 1e-4
"""Relative difference of two equilibria of the same elements up to which they are one; Newton's method ends
four orders of magnitude below."""


@dataclass(frozen=True, eq=False)
class _Branch:
    """A stable equilibrium, and the names of the solvers that found it."""

    equilibrium: "Equilibrium"
    solvers: list[str]

    @property
    def name(self) -> str:
        return " and ".join(self.solvers)


def with_branches(evaluations: Sequence[Evaluation], problem: Problem) -> tuple[list[Evaluation], list[str]]:
    """The evaluations, those on different branches of equilibrium with a sentence on it; and remarks.

    Where two converged results of one law of finite strain differ by more than they say, Newton's method goes
    on from each on the finite elements of `fem-nonlinear`. If it ends in several stable equilibria, their
    energies there say which one is the least; the prescribed motion does no other work. A found contact, a
    body in three dimensions and solvers that were given markers are left out.

    Args:
        evaluations: Sampled on the problem's mesh.
        problem: What was solved; each evaluation knows its own law.
    """
    judged, remarks = {evaluation.solver: evaluation for evaluation in evaluations}, []
    comparable = [evaluation for evaluation in evaluations if _judged(evaluation, problem)]
    for law in dict.fromkeys(evaluation.law for evaluation in comparable):
        some = [evaluation for evaluation in comparable if evaluation.law == law]
        if not any(_unlike(*pair) for pair in combinations(some, 2)):
            continue
        own = replace(problem, material=problem.material.model_copy(update={"law": law}))
        branches, lost = _branches(some, own)
        if lost:
            remarks.append(_lost(lost))
        if len(branches) < 2:
            continue
        for branch in branches:
            for name in branch.solvers:
                message = f"{judged[name].message.rstrip('. ')}; {_place(branch, branches)}"
                judged[name] = replace(judged[name], message=message)
        remarks.append(_remark(branches))
    return list(judged.values()), remarks


def _judged(evaluation: Evaluation, problem: Problem) -> bool:
    given = evaluation.in_sample or evaluation.solid or problem.load.kind == "cylinder"
    return evaluation.law != "linear" and evaluation.converged and evaluation.finite and not given


def _unlike(first: Evaluation, second: Evaluation) -> bool:
    """Whether displacements differ by more than both results say."""
    stated = sum(
        evaluation.uncertainty.displacement.rel_l2
        for evaluation in (first, second)
        if evaluation.uncertainty is not None
    )
    difference = field_difference(second.displacement, first.displacement, first.weights)
    return difference.rel_l2 > ALIKE + stated


def _branches(evaluations: Sequence[Evaluation], problem: Problem) -> tuple[list[_Branch], list[str]]:
    """The stable equilibria beside results, that of least energy first; names of results that have none."""
    try:
        make_solver("fem-nonlinear")
    except MissingLibraryError as error:
        warnings.warn(f"results differ, and nobody looks for branches: {error}", stacklevel=2)
        return [], []
    from solvers.fem.finite_strain.nearby import equilibria_near

    starts = [np.concatenate([entry.node_displacement, entry.edge_displacement]) for entry in evaluations]
    branches: list[_Branch] = []
    lost = []
    for evaluation, found in zip(evaluations, equilibria_near(problem, starts), strict=True):
        if found is None or found.unstable:
            lost.append(evaluation.solver)
            continue
        for branch in branches:
            other = branch.equilibrium.nodal
            if np.linalg.norm(found.nodal - other) < SAME * np.linalg.norm(other):
                branch.solvers.append(evaluation.solver)
                break
        else:
            branches.append(_Branch(found, [evaluation.solver]))
    return sorted(branches, key=lambda branch: branch.equilibrium.energy), lost


def _lost(names: Sequence[str]) -> str:
    return (
        "results differ by more than they say, and no stable equilibrium was found on the elements of "
        f"fem-nonlinear beside {' and '.join(names)}: whether this load has several is open"
    )


def _place(branch: _Branch, branches: Sequence[_Branch]) -> str:
    """A clause on a branch among others, the first of which has the least energy."""
    least = branches[0]
    if branch is least:
        more = _above(branches[1], least)
        others = ", ".join(other.name for other in branches[1:])
        return f"of several stable equilibria the one of least energy; that of {others} has {more}"
    return (
        f"NOT THE EQUILIBRIUM OF LEAST ENERGY: it is stable, but has {_above(branch, least)} than another "
        f"stable one, which {least.name} found"
    )


def _above(branch: _Branch, least: _Branch) -> str:
    energy = branch.equilibrium.energy / least.equilibrium.energy - 1
    return "no more energy" if energy < ROUNDING else f"{percent(energy, 2)} more energy"


def _remark(branches: Sequence[_Branch]) -> str:
    parts = [f"{branch.name} {branch.equilibrium.energy:.5g} N mm/mm" for branch in branches]
    return (
        f"{len(branches)} stable equilibria under this load (the finger buckles): {', '.join(parts)}, by the "
        "elements of fem-nonlinear; what these results differ by is no error of either"
    )
