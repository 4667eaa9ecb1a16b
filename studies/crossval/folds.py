"""Folds: the markers and loads that are held out together."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pinnray.geometry.observations import Observations
from pinnray.runtime.errors import UserError
from pinnray.solvers.problem import Load, Problem, contact_ends

ALL, ONE, TIP, RANDOM, LOAD = "all", "one-out", "tip-out", "random", "load-out"
SCHEMES = {
    ALL: "every marker given: nothing held out, but for the fields",
    ONE: "each marker held out in its turn",
    TIP: "the third of the markers nearest the tip held out together",
    RANDOM: "a random third of the markers held out",
    LOAD: "every marker given at the full stroke; other strokes and contacts predicted",
}
"""Every scheme with the markers or loads that it holds out."""

DRAWS = 10
"""Draws of `RANDOM`, equal for every seed and solver, so that differences are paired."""


@dataclass(frozen=True)
class LoadCase:
    """A load at which solvers predict the markers."""

    name: str
    load: Load
    share: float  # its stroke over the full one
    contact: float  # abscissa of the contact's middle, mm


@dataclass(frozen=True)
class Fold:
    """Markers, or a load, held out together."""

    scheme: str
    name: str  # unique in its scheme
    held: tuple[int, ...]  # numbers of the markers that are not given, from zero
    load_case: int = 0  # number of the predicted load; markers are given at load case zero


def load_cases_of(problem: Problem, *, others: bool) -> list[LoadCase]:
    """The full load and, if asked for, smaller strokes and other contacts."""
    load, middle = problem.load, float(np.mean(contact_ends(problem)))
    cases = [LoadCase("full", load, 1.0, middle)]
    if not others:
        return cases
    if load.kind == "patch":
        raise UserError(
            f"{LOAD} presses elsewhere on the same mesh, which a load of kind patch cannot; take mean, or "
            f"schemes without {LOAD}"
        )
    stroke = float(np.linalg.norm(load.values))
    for share in (0.5, 0.75):  # smaller strokes
        displacement = tuple(None if value is None else share * value for value in load.displacement)
        smaller = load.model_copy(update={"displacement": displacement})
        cases.append(LoadCase(f"stroke {share * stroke:g}", smaller, share, middle))
    for at in (middle - 5.0, middle + 5.0):  # other contacts, mm
        moved = load.model_copy(update={"position": at})
        try:
            replace(problem, load=moved)
        except UserError as error:
            raise UserError(f"{LOAD}: {error}; take schemes without it") from None
        cases.append(LoadCase(f"contact {at:g}", moved, 1.0, at))
    return cases


def folds_of(schemes: Sequence[str], count: int, load_cases: Sequence[LoadCase]) -> list[Fold]:
    """The folds of schemes for markers that are ordered from base to tip.

    Args:
        schemes: Keys of `SCHEMES`; `ALL` is added.
        count: Number of markers.
        load_cases: The full load first.
    """
    third = max(1, round(count / 3))
    draws = np.random.default_rng(0)
    folds = [Fold(ALL, "all", ())]
    if ONE in schemes:
        folds += [Fold(ONE, f"marker {marker + 1}", (marker,)) for marker in range(count)]
    if TIP in schemes:
        folds.append(Fold(TIP, "tip", tuple(range(count - third, count))))
    if RANDOM in schemes:
        picked = [sorted(draws.choice(count, third, replace=False).tolist()) for _ in range(DRAWS)]
        folds += [Fold(RANDOM, f"draw {number}", tuple(held)) for number, held in enumerate(picked, 1)]
    if LOAD in schemes:
        folds += [Fold(LOAD, case.name, (), number) for number, case in enumerate(load_cases) if number > 0]
    return folds


def hide_markers(observations: Observations, held: Sequence[int]) -> Observations:
    """The observations without the held-out markers: invisible, and their numbers zero."""
    keep = ~np.isin(np.arange(len(observations.points)), held)
    both = observations.displacements, observations.standard_deviations
    displacements, deviations = (np.where(keep[:, None], values, 0.0) for values in both)
    return replace(observations, displacements=displacements, standard_deviations=deviations, visible=keep)
