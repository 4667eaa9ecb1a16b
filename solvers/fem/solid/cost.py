"""Memory and time of a solution in three dimensions, told before it starts.

Fitted to the default finger with elements of 0.5 to 1 mm and 4 to 12 layers, on one core: factors by MUMPS of
235,000 to 812,000 unknowns have 93 to 740 million entries and take 6 to 80 s; multigrid takes 20 s a Newton
step at 235,000. Other bodies may differ by a factor of two.
"""

from dataclasses import dataclass

from geometry.errors import UserError
from solvers.fem.linear_solvers import LinearSolver


@dataclass(frozen=True)
class Cost:
    """The linear solver and its price."""

    unknowns: int
    levels: int  # Number of nodes above each other
    iterative: bool  # Whether multigrid solves, not factors

    @property
    def _entries(self) -> float:
        """Estimated entries of the factors."""
        nodes = self.unknowns / (3 * self.levels)
        return float(self.unknowns * (100 + 33 * self.levels) * (nodes / 8500) ** 0.25)

    @property
    def memory_gb(self) -> float:
        """Estimated memory, GB: matrix and vectors, and factors or the coarser matrices."""
        return 3.4e-6 * self.unknowns if self.iterative else 2.4e-6 * self.unknowns + 1e-8 * self._entries

    @property
    def words(self) -> str:
        """Unknowns, method, memory and time of a Newton step on one core."""
        if self.iterative:
            how, seconds = "iterative", float(110 * (1e-6 * self.unknowns) ** 1.17)
        else:
            how, seconds = "direct", 2e-5 * self.unknowns + 1.3e-10 * self._entries**2 / self.unknowns
        time = f"{max(1.0, seconds):.0f} s" if seconds < 100 else f"{seconds / 60:.0f} min"
        return f"{self.unknowns:,} unknowns, {how}: about {self.memory_gb:.1f} GB, {time} a Newton step"


def affordable(unknowns: int, levels: int, asked: LinearSolver, free_gb: float) -> Cost:
    """The linear solver that is asked for or, if "auto", direct where memory allows it.

    A `UserError` says that the memory that is free does not suffice; a solution may take 70 % of it.
    """
    methods = {"auto": (False, True), "direct": (False,), "iterative": (True,)}[asked]
    costs = [Cost(unknowns, levels, iterative) for iterative in methods]
    for cost in costs:
        if cost.memory_gb <= 0.7 * free_gb:
            return cost
    advice = "take fewer layers or a coarser mesh"
    if asked == "direct":
        advice = f"take linear_solver=iterative, {advice.removeprefix('take ')}"
    raise UserError(
        f"fem-3d would need about {costs[-1].memory_gb:.1f} GB for {unknowns:,} unknowns, "
        f"and {free_gb:.1f} GB are free; {advice}"
    )
