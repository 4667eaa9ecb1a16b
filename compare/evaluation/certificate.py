"""Error certificate of a solution of the linear problem, by the energy of finite elements."""

from dataclasses import dataclass

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.tables import percent

ENERGY_LIMIT = 0.02
"""Most energy that the imbalance of a converged solution may have, relative to the energy of `fem`.

It is 14 % in the energy norm, which adds up the errors of all stress components; with the networks of this
project the von Mises stress is then within 10 %. Beyond it a picture of the stress misleads. A solver that
reports less energy than `fem` by more than this has a quadrature that misses some: a solution can be better
than `fem` by what `fem` would gain on a finer mesh, 1.5 % with three elements across every wall.
"""

INTERPOLANT_LIMIT = 0.05
"""Largest excess energy of the interpolant of a converged solution, relative to the energy of `fem`.

Interpolation at corners, where stress has no bound, costs energy: the interpolant of a nearly exact solution
has 1 % too much on the default mesh and 3 % with three elements across every wall. A field that is wrong
between the points where its stress was looked at has far more.
"""

WORK_LIMIT = 0.05
"""Largest reported energy above that of `fem`, and deviation of the work of the reported force, relative.

Both are integrals, so that networks and coarse elements that pass the other limits have them to 1 %; a wrong
sign, unit or factor has far more.
"""

CONDITION_LIMIT = 0.02
"""Largest deviation from the conditions of a converged solution, relative to the prescribed displacement."""

ROUNDING = 1e-8
"""Relative difference that the rounding of a direct solver explains."""


@dataclass(frozen=True, eq=False)
class Certificate:
    """A solution against the finite-element solution of the same mesh, by energies per depth, N mm / mm.

    Its interpolant in the finite-element space is split into the minimiser of the energy with the same values
    at base and contact, and a rest. The rest and what the conditions were missed by are orthogonal in energy:
    the difference between the interpolant and the solution of `fem` has the energy `excess + violation`.
    """

    energy: float  #: Of the interpolant.
    fem_energy: float  #: Of the solution of `fem`.
    excess: float  #: Amount of `energy` above the least that the same values at base and contact allow.
    violation: float  #: Energy of the least displacement by which the missed conditions would be met.
    missed: float  #: Amount of the solver's own energy below that least energy; negative if it is above.
    #: Imbalance of the solver's own stress against all test functions, in the dual of the energy norm, over
    #: the norm of the solution of `fem`.
    weak_residual: float
    imbalance: float  #: Largest force on a node that is not in balance, over the reaction of `fem`.
    base: float  #: Largest displacement on the base, mm.
    load: FloatArray  #: Largest deviation from the prescribed u and v, shape (2,), mm; NaN where free.
    work: float  #: Of the own reaction on the prescribed displacement; twice the energy in equilibrium.
    stroke: float  #: Largest prescribed displacement, mm.

    @property
    def rel_excess(self) -> float:
        """Excess over the energy of `fem`."""
        return self.excess / self.fem_energy

    @property
    def rel_violation(self) -> float:
        """Violation over the energy of `fem`."""
        return self.violation / self.fem_energy

    @property
    def energy_norm_error(self) -> float:
        """Relative difference of the interpolant from `fem` in the energy norm."""
        return float(np.sqrt(self.rel_excess + self.rel_violation))

    @property
    def has_excess(self) -> bool:
        """True if the excess is beyond rounding; the solution of `fem` has none."""
        return self.rel_excess > ROUNDING**2

    @property
    def off_at_contact(self) -> float:
        """Larger of the deviations from the prescribed u and v, mm."""
        return float(np.nanmax(self.load))

    @property
    def misses_energy(self) -> bool:
        """True if the reported energy is so low that the quadrature must have missed some."""
        return self.missed > ENERGY_LIMIT * self.fem_energy

    @property
    def faults(self) -> list[str]:
        """Reasons why the solution does not count as converged."""
        limit = np.sqrt(ENERGY_LIMIT)
        off, most = max(self.base, self.off_at_contact), CONDITION_LIMIT * self.stroke
        reported = -self.missed / self.fem_energy
        work = self.work / (2 * self.fem_energy) - 1
        kept = {
            f"its stress is out of balance by {percent(self.weak_residual, 2)} in the energy norm "
            f"(limit {percent(limit, 2)})": self.weak_residual <= limit,
            f"it misses the conditions by up to {off:.2g} mm (limit {most:.2g} mm)": off <= most,
            f"its energy is {percent(self.rel_excess, 2)} above that of fem "
            f"(limit {percent(INTERPOLANT_LIMIT, 1)})": self.rel_excess <= INTERPOLANT_LIMIT,
            f"it reports an energy {percent(reported, 2)} above that of fem "
            f"(limit {percent(WORK_LIMIT, 1)})": reported <= WORK_LIMIT,
            f"it reports a force whose work is {percent(work, 2)} off twice the energy of fem "
            f"(limit {percent(WORK_LIMIT, 1)})": abs(work) <= WORK_LIMIT,
        }
        faults = [fault for fault, within in kept.items() if not within]
        return [fault.replace("\N{NO-BREAK SPACE}", " ") for fault in faults]  # for files and terminals
