"""Which markers and loads a solver is not given, so that it can be judged by them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from geometry.arrays import FloatArray
from geometry.errors import UserError
from geometry.observations import Observations
from solvers.problem import Load, Problem, contact_ends

ALL, ONE, TIP, RANDOM, LOAD = "all", "one-out", "tip-out", "random", "load-out"
SCHEMES = {
    ALL: "every marker given: nothing held out, but for the fields",
    ONE: "each marker held out in its turn",
    TIP: "the third of the markers nearest the tip held out together",
    RANDOM: "a random third of the markers held out",
    LOAD: "every marker given at the full stroke; other strokes and contacts predicted",
}
"""Every scheme and what it holds out."""

DRAWS = 10
"""Of `RANDOM`; the same for every seed and solver, so that differences are paired."""

STROKES = (0.5, 0.75)
"""Other loads of `LOAD`: parts of the stroke,"""
CONTACTS = (-5.0, 5.0)
"""and how far along the finger the contact is elsewhere, mm."""


@dataclass(frozen=True)
class LoadCase:
    """A load at which the finger is looked at.

    Attributes:
        name: For people and files.
        load: As the solvers take it.
        share: Its stroke over the full one.
        contact: Abscissa of the contact's middle, mm.
    """

    name: str
    load: Load
    share: float
    contact: float


@dataclass(frozen=True)
class Fold:
    """What is held out at once.

    Attributes:
        scheme: A key of `SCHEMES`.
        name: Of the fold, unique in its scheme.
        held: Numbers of the markers that are not given, from zero.
        condition: Number of the load at which is predicted; zero is the one at which markers are given.
    """

    scheme: str
    name: str
    held: tuple[int, ...]
    condition: int = 0

    @property
    def unseen(self) -> tuple[int, ...] | None:
        """The markers by which is judged; None for all of them, at a load that was not seen."""
        return None if self.condition else self.held


def load_cases_of(problem: Problem, *, others: bool) -> list[LoadCase]:
    """The full load and, if asked for, others: less stroke, and the contact elsewhere."""
    load, middle = problem.load, float(np.mean(contact_ends(problem)))
    full = LoadCase("full", load, 1.0, middle)
    if not others:
        return [full]
    stroke = float(np.linalg.norm(load.values))
    less = [LoadCase(f"stroke {share * stroke:g}", _scaled(load, share), share, middle) for share in STROKES]
    if load.kind == "patch":
        raise UserError(
            f"{LOAD} presses elsewhere on the same mesh, which --load patch cannot; take mean, or --schemes "
            f"without {LOAD}"
        )
    moved = [
        LoadCase(f"contact {at:g}", load.model_copy(update={"position": at}), 1.0, at)
        for at in (middle + by for by in CONTACTS)
    ]
    for condition in moved:
        try:
            replace(problem, load=condition.load)
        except UserError as error:
            raise UserError(f"{LOAD}: {error}; take --schemes without it") from None
    return [full, *less, *moved]


def folds_of(schemes: Sequence[str], count: int, conditions: Sequence[LoadCase]) -> list[Fold]:
    """The folds of schemes for markers that are ordered from base to tip.

    Args:
        schemes: Keys of `SCHEMES`; `ALL` is there in any case.
        count: Number of markers.
        conditions: The full load first.
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
        folds += [
            Fold(LOAD, condition.name, (), number)
            for number, condition in enumerate(conditions)
            if number > 0
        ]
    return folds


def hide_markers(observations: Observations, held: Sequence[int]) -> Observations:
    """The observations without those held out, of which not even the numbers are left."""
    keep = np.ones(len(observations.points), dtype=bool)
    keep[list(held)] = False
    blank: FloatArray = np.where(keep[:, None], observations.displacements, 0.0)
    deviations: FloatArray = np.where(keep[:, None], observations.standard_deviations, 0.0)
    return replace(observations, displacements=blank, standard_deviations=deviations, visible=keep)


def _scaled(load: Load, share: float) -> Load:
    moved = tuple(None if value is None else share * value for value in load.displacement)
    return load.model_copy(update={"displacement": moved})
