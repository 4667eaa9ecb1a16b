"""Settings of the solvers that identify contact, walls and law from the markers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal, get_args

import numpy as np

from geometry.errors import UserError
from solvers.assimilation.estimation import COST_CHANGE
from solvers.elasticity import LawName
from solvers.identification.body import Body
from solvers.identification.hypothesis import DEFAULT, Unknowns, parse_unknowns
from solvers.identification.identifier import Identifier
from solvers.problem import Problem

LAWS: tuple[LawName, ...] = ("neo-hookean", "st-venant-kirchhoff")
"""The laws of finite strain."""

LawChoice = Literal["evidence", "given"]


@dataclass(frozen=True, kw_only=True)
class IdentificationSettings:
    """Settings of a solver that identifies.

    Attributes:
        parameters: Names of what is to be found, with commas between them, of
            `solvers.identification.hypothesis.MEANINGS`; empty for all but `young`.
        law: "evidence": the law with the largest evidence of those of finite strain; "given": the problem's.
        prior: Factor of the parameters' prior standard deviations.
        reaction: Measured force of the indenter on the finger along y per depth, N/mm; None if there is none.
        reaction_error: Standard deviation of the reaction over its size.
        marker_radius: Radius of the discs over which the displacement is averaged, mm; None: that of the
            observations; zero: the markers' centres alone.
    """

    parameters: str = ""
    law: LawChoice = "evidence"
    prior: float = 1.0
    reaction: float | None = None
    reaction_error: float = 0.02
    marker_radius: float | None = None
    name: ClassVar[str]
    assimilates: ClassVar[bool] = True

    def check(self, names: Sequence[str]) -> None:
        """Raise a `UserError` for a setting out of its range, or for Young's modulus without a force."""
        if self.law not in get_args(LawChoice):
            raise UserError(f"{self.name}: law must be {' or '.join(get_args(LawChoice))}, got {self.law!r}")
        if "young" in names and self.reaction is None:
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

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the unknowns."""
        return parse_unknowns(self.name, self.parameters) if self.parameters else DEFAULT

    @property
    def measured_reaction(self) -> tuple[float, float] | None:
        """The reaction with its standard deviation, N/mm."""
        return None if self.reaction is None else (self.reaction, self.reaction_error * abs(self.reaction))

    def identifier(
        self,
        problem: Problem,
        body: Callable[[Unknowns], Body],
        laws: Sequence[LawName] | None = None,
        cost_change: float = COST_CHANGE,
    ) -> Identifier:
        """The search for a problem, among the laws that the setting allows unless they are given."""
        if laws is None:
            laws = LAWS if self.law == "evidence" else (problem.material.law,)
        return Identifier(
            problem,
            self.unknowns,
            laws,
            body,
            prior=self.prior,
            radius=self.marker_radius,
            cost_change=cost_change,
        )
