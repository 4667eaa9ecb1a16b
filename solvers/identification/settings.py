"""Settings of the solvers that identify contact, walls and law from the markers."""

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from pinnray.runtime.errors import UserError
from pinnray.solvers.identification.transfer import transferred
from pinnray.solvers.identification.unknowns import CONTACT, CYLINDER, DEFAULT, parse_unknowns
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import FieldSettings

LawChoice = Literal["evidence", "given"]


@dataclass(frozen=True, kw_only=True)
class IdentifyingSolver(FieldSettings):
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
    sought: ClassVar[tuple[str, ...]] = DEFAULT
    assimilates: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if "young" in self.unknowns and self.reaction is None:
            raise UserError(
                f"{self.name} cannot find young from displacements alone: forces and stresses are in "
                "proportion to it; give reaction=, N/mm"
            )
        self.check_positive("prior", "reaction_error")
        if self.reaction is not None and not (np.isfinite(self.reaction) and self.reaction):
            raise UserError(
                f"{self.name}: the reaction must be a force other than zero, N/mm, got {self.reaction}"
            )
        self.check_not_negative("marker_radius")

    def transferred(self, solution: Solution, problem: Problem, other: Problem) -> Solution:
        """The solution at another load with the finger of a solution; see `transfer`."""
        return transferred(solution, problem, other)

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the unknowns."""
        return parse_unknowns(self.name, self.parameters, self.sought) if self.parameters else self.sought

    @property
    def under_cylinder(self) -> tuple[str, ...]:
        """Those with the unknowns of a cylinder in place of a patch's, of which the place may be none."""
        own = (name for name in CYLINDER if name not in CONTACT or name in self.unknowns)
        return *own, *(name for name in self.unknowns if name not in CONTACT)
