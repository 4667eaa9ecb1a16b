"""Memory and time of a solution in three dimensions, told before it starts.

Fitted to the default finger with elements of 0.5 to 1 mm and 4 to 12 layers, on one core: factors by MUMPS of
235,000 to 812,000 unknowns have 93 to 740 million entries and take 6 to 80 s; multigrid takes 20 s a Newton
step at 235,000. Other bodies may differ by a factor of two.
"""

from dataclasses import dataclass
from typing import Literal

from geometry.errors import UserError

LinearSolver = Literal["auto", "direct", "iterative"]

METHODS = {"auto": (False, True), "direct": (False,), "iterative": (True,)}
"""By the linear solver that is asked for, whether to iterate, in the order to try."""

USABLE = 0.7
"""Share of the free memory that a solution may take."""


@dataclass(frozen=True)
class Cost:
    """The linear solver and its price."""

    unknowns: int  # Number of unknowns
    levels: int  # Number of nodes above each other
    iterative: bool  # Whether multigrid solves, not factors

    @property
    def entries(self) -> float:
        """Estimated entries of the factors."""
        nodes = self.unknowns / (3 * self.levels)
        return float(self.unknowns * (100 + 33 * self.levels) * (nodes / 8500) ** 0.25)

    @property
    def memory_gb(self) -> float:
        """Estimated memory, GB: matrix and vectors, and factors or the coarser matrices."""
        return 3.4e-6 * self.unknowns if self.iterative else 2.4e-6 * self.unknowns + 1e-8 * self.entries

    @property
    def step_seconds(self) -> float:
        """Estimated time of a Newton step on one core, s."""
        if self.iterative:
            return float(110 * (1e-6 * self.unknowns) ** 1.17)
        return 2e-5 * self.unknowns + 1.3e-10 * self.entries**2 / self.unknowns

    @property
    def words(self) -> str:
        """Unknowns, method, memory and time."""
        how = "iterative" if self.iterative else "direct"
        time = max(1.0, self.step_seconds)
        size = f"{time:.0f} s" if time < 100 else f"{time / 60:.0f} min"
        return f"{self.unknowns:,} unknowns, {how}: about {self.memory_gb:.1f} GB, {size} a Newton step"


def affordable(unknowns: int, levels: int, asked: LinearSolver, free_gb: float) -> Cost:
    """The linear solver that is asked for or, if "auto", direct where memory allows it.

    Raises:
        UserError: If the memory that is free does not suffice.
    """
    costs = [Cost(unknowns, levels, iterative) for iterative in METHODS[asked]]
    for cost in costs:
        if cost.memory_gb <= USABLE * free_gb:
            return cost
    advice = "take fewer layers or a coarser mesh"
    if asked == "direct":
        advice = f"take linear_solver=iterative, {advice.removeprefix('take ')}"
    raise UserError(
        f"fem-3d would need about {costs[-1].memory_gb:.1f} GB for {unknowns:,} unknowns, "
        f"and {free_gb:.1f} GB are free; {advice}"
    )
