"""Settings of the solvers that identify contact, walls and law from the markers."""

from dataclasses import asdict, dataclass
from typing import ClassVar, Literal, get_args

import numpy as np

from pinnray.runtime.errors import UserError
from pinnray.solvers.identification.transfer import transferred
from pinnray.solvers.identification.unknowns import DEFAULT, parse_unknowns
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution

LawChoice = Literal["evidence", "given"]


@dataclass(frozen=True, kw_only=True)
class IdentifyingSolver:
    """A solver that identifies contact, walls and law.

    Attributes:
        parameters: Names of the unknowns, with commas between them, of `sought` and `young`; empty for all of
            `sought`.
        law: "evidence": the law of finite strain with the largest evidence; "given": the problem's.
        prior: Factor of the parameters' prior standard deviations.
        reaction: Measured force of the indenter on the finger along y per depth, N/mm; None if there is none.
        reaction_error: Standard deviation of the reaction over its size.
        marker_radius: Radius of the discs over which the displacement is averaged, mm; None: the
            observations' own; zero: the markers' centres alone.
    """

    parameters: str = ""
    law: LawChoice = "evidence"
    prior: float = 1.0
    reaction: float | None = None
    reaction_error: float = 0.02
    marker_radius: float | None = None
    name: ClassVar[str]
    sought: ClassVar[tuple[str, ...]] = DEFAULT
    assimilates: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if self.law not in get_args(LawChoice):
            raise UserError(f"{self.name}: law must be {' or '.join(get_args(LawChoice))}, got {self.law!r}")
        if "young" in self.unknowns and self.reaction is None:
            raise UserError(
                f"{self.name} cannot find young from displacements alone: forces and stresses are in "
                "proportion to it; give reaction=, N/mm"
            )
        for setting in ("prior", "reaction_error"):
            if not (np.isfinite(value := getattr(self, setting)) and value > 0):
                raise UserError(f"{self.name}: {setting} must be positive, got {value}")
        if self.reaction is not None and not (np.isfinite(self.reaction) and self.reaction):
            raise UserError(
                f"{self.name}: the reaction must be a force other than zero, N/mm, got {self.reaction}"
            )
        if self.marker_radius is not None and not 0 <= self.marker_radius < np.inf:
            raise UserError(f"{self.name}: marker_radius must be zero or more, got {self.marker_radius}")

    def settings(self) -> dict[str, object]:
        """Unknowns, law, priors and discretisation."""
        return asdict(self)

    def transferred(self, solution: Solution, problem: Problem, other: Problem) -> Solution:
        """The solution at another load with the finger of a solution; see `transfer`."""
        return transferred(solution, problem, other)

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the unknowns."""
        return parse_unknowns(self.name, self.parameters, self.sought) if self.parameters else self.sought
