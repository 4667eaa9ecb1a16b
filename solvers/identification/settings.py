"""Settings of the solvers that identify contact, walls and law from the markers."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

from pinnray.geometry.finger.learned import Learned
from pinnray.geometry.observations import Observations
from pinnray.runtime.errors import UserError
from pinnray.solvers.identification.transfer import transferred
from pinnray.solvers.identification.unknowns import CONTACT, CYLINDER, DEFAULT, parse_unknowns
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import FieldSettings, Progress, Solver, silent, with_law

LawChoice = Literal["evidence", "given"]


@dataclass(frozen=True, kw_only=True)
class IdentifyingSolver(FieldSettings):
    """A solver that identifies contact, walls and law.

    Attributes:
        parameters: Names of the unknowns, with commas between them, of `sought`; empty for all of them.
            Young's modulus is one, too, where it is not known exactly.
        law: "evidence": the law of finite strain with the largest evidence; "given": the problem's.
        prior: Factor of the parameters' prior standard deviations.
        marker_radius: Radius of the discs over which the displacement is averaged, mm; None: the
            observations' own; zero: the markers' centres alone.
    """

    parameters: str = ""
    law: LawChoice = "evidence"
    prior: float = 1.0
    marker_radius: float | None = None
    sought: ClassVar[tuple[str, ...]] = DEFAULT
    # Of the load come the drawn contact and a cylinder
    loads: ClassVar[tuple[str, ...]] = ("mean", "point", "patch", "cylinder")
    friction: ClassVar[bool] = True
    assimilates: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if self.parameters:
            parse_unknowns(self.name, self.parameters, self.sought)  # or says what is wrong
        self.check_positive("prior")
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


def taught(
    solver: Solver, problem: Problem, presses: Sequence[Observations], progress: Progress = silent
) -> Learned | None:
    """What pictures of a problem's finger teach a solver that identifies it, one after another.

    Each is fitted with what those before it have taught: as one fit of all of them, to first order.

    Raises:
        UserError: If a picture cannot be fitted.
    """
    learned, material = problem.learned, with_law(problem.material, solver)
    for number, press in enumerate(presses):
        progress(number / len(presses), press.source)
        own = replace(problem, observations=press, learned=learned, material=material)
        found = solver.solve(own, silent)
        if not found.status.converged or found.identified is None:
            raise UserError(f"{press.source}: {found.status.message}")
        learned = found.identified.learned
    return learned
