"""The load path from rest to the full load, in adaptive steps."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix

from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.contact.contact_region import ContactRegion
from pinnray.solvers.extrusion import NodalSpace
from pinnray.solvers.fem.boundary_conditions import DisplacementConstraints, reaction_by_residual_work
from pinnray.solvers.fem.equilibrium import DiscreteEquilibrium, LoadState
from pinnray.solvers.fem.finite_strain.newton import ConstrainedNewton
from pinnray.solvers.problem import Problem
from pinnray.solvers.solver import Progress
from pinnray.solvers.stability import aside, descended

BESIDE = 0.05
"""Largest distance of an equilibrium from that on coarser elements over the largest displacement; one that is
further away is of another branch."""
CARRIED = 40
"""Newton iterations from an equilibrium on coarser elements; the first ones undo stretching of thin walls."""
PENETRATION, ROUGH = 1e-5, 1e-3
"""Largest gap of a node in contact and penetration of any node, mm, and the same where near will do."""
ROUGH_TOLERANCE = 1e-4
"""Largest residual force over the largest internal force where near will do."""
QUARTERS = (0.25, 0.5, 0.75)
"""Fractions of the load at which a step ends in any case, because the force is told there."""
ALIKE = 2.0
"""Largest ratio of the forces on coarse and fine elements at the full load; it scales those on the way."""
LET_GO, LEAP = 0.05, 3.0
"""Force over the largest one on the way below which a finger is leaving a cylinder where its path ends, and
motion in a step, per load, over the median above which it is at a limit point."""
HARDER = 10.0
"""Stiffness of a contact that starts from coarser elements, over its own: from so near, multipliers that
settle sooner cost no more iterations each time."""


@dataclass(frozen=True)
class LoadSteps:
    """Settings of a load path."""

    first_step: float = 0.05  # First fraction of the load
    max_step: float = 0.2  # Largest fraction of the load in one step
    min_step: float = 1e-3  # Fraction of the load below which the solver gives up
    tolerance: float = 1e-8  # Largest residual force over the largest internal force
    max_iterations: int = 12  # Newton iterations in one step
    # Fractions of the load at which a step ends; with any, all steps are on the given elements, and exact
    stops: tuple[float, ...] = ()


def check_stops(solver: str, stops: Sequence[float]) -> None:
    """Raise a `UserError` unless the `stops` of a solver are fractions of the load."""
    if outside := [stop for stop in stops if not 0 <= stop <= 1]:
        raise UserError(f"{solver}: stops are fractions of the stroke, 0 to 1, not {outside[0]:g}")


class LoadPath:
    """Equilibria of a problem as its load grows: `points`, from rest.

    Every step starts from the last three states extrapolated (two with a cylinder), the first from the linear
    solution. A step whose Newton iteration fails is halved.

    Args:
        problem: With the full load.
        space: The elements.
        constraints: Their targets grow with the load; the load's own if None.
        steps: Their sizes and Newton's method.
        exact_from: Fraction of the load before which the equilibria need be near only.
    """

    def __init__(
        self,
        problem: Problem,
        space: NodalSpace,
        constraints: DisplacementConstraints | None = None,
        *,
        steps: LoadSteps,
        exact_from: float = 0.0,
    ) -> None:
        self._steps, self.space = steps, space
        self.equilibrium = DiscreteEquilibrium(problem, space, constraints)
        self._newton, self._exact_from = self._begin(), exact_from
        # For equilibria that need be near only
        self._rough = self._begin(tolerance=ROUGH_TOLERANCE) if exact_from > 0 else None
        contact = self.equilibrium.contact
        self._max_step = steps.max_step if contact is None else min(steps.max_step, contact.longest_step)
        self.points = [self.equilibrium.rest]
        self.left = 0  # Number of unstable equilibria that were left for a stable one
        self._halved = self._iterations = 0  # Failed steps; Newton iterations of all steps
        self._tangent = False  # Whether the tangent of the last equilibrium stands factorised
        self._weights: csr_matrix | None = None  # Of coarser nodes at this path's
        self._reason = ""  # Why the last failed step failed, for Newton's method in PETSc's word

    def _begin(self, tolerance: float = 0.0, max_iterations: int = 0) -> ConstrainedNewton:
        """Newton's method, with the larger settings, these or those of the steps."""
        steps = self._steps
        most = max(steps.max_iterations, max_iterations)
        return ConstrainedNewton(self.equilibrium, max(steps.tolerance, tolerance), most)

    def close(self) -> None:
        """Free what PETSc holds."""
        self._newton.close()
        if self._rough is not None:
            self._rough.close()
        self.equilibrium.factors.destroy()

    def follow(self, progress: Progress) -> None:
        """Go to the full load, or as far as equilibria are found."""
        contact, step = self.equilibrium.contact, min(self._steps.first_step, self._max_step)
        rubs = contact is not None and contact.coefficient > 0  # friction depends on the way
        stops = sorted({*self._steps.stops, *(() if self.equilibrium.linear or rubs else QUARTERS)})
        while (last := self.points[-1].fraction) < 1:
            stop = next((each for each in stops if each > last), 1.0)
            rest = stop - last
            fraction = stop - rest * (1 - 1 / math.ceil(rest / step - 1e-9))  # equal steps to the stop
            before = self._iterations
            point, hardest = self._found(self._guess(fraction))
            if point is None:
                self._halved += 1
                step /= 2
                if step < self._steps.min_step:
                    return
                progress(
                    self.points[-1].fraction, f"{fraction:.1%} of the load, for which no equilibrium is found"
                )
                continue
            point = self._stable(point)
            self.points.append(point)
            progress(fraction, f"{fraction:.0%} of the load, {self._iterations - before} Newton iterations")
            step = min(self._max_step, step * (2 if hardest <= 5 else 1))

    def take_over(self, way: "LoadPath") -> bool:
        """Go to the full load at once, from its equilibrium on coarser elements of the same body.

        Not where that is not reached or buckles, or leads to no stable equilibrium near it with a like force:
        then `points` stay as they are.
        """
        last = way.points[-1]
        if last.fraction < 1 or way.left or way.equilibrium.unstable:
            return False
        nodal, contact = self.interpolated(way, last.nodal), self._carried_contact(way, last)
        guess = replace(self.equilibrium.rest, fraction=1.0, nodal=nodal, forces=last.forces, contact=contact)
        newton, self._newton = self._newton, self._begin(max_iterations=CARRIED)
        own = self.equilibrium.contact
        harder = [replace(own, stiffness=HARDER * own.stiffness)] if own else []
        for self.equilibrium.contact in (*harder, own):
            found, _ = self._found(guess)
            if found is not None:
                break
        self.equilibrium.contact = own
        self._newton.close()
        self._newton = newton
        size = np.abs(guess.nodal).max()
        if found is None or np.abs(found.nodal - guess.nodal).max() > BESIDE * size:
            return False
        if not self._tangent:
            self.equilibrium.factorise(found)
        forces = [np.linalg.norm(path.reaction(end)) for path, end in ((self, found), (way, last))]
        if self.equilibrium.unstable or max(forces) > ALIKE * min(forces):
            return False
        self.points.append(found)
        return True

    def interpolated(self, way: "LoadPath", nodal: FloatArray) -> FloatArray:
        """Displacements of this path's nodes, shape (N, d), mm, from those of coarser plane elements."""
        if self._weights is None:
            own, coarse = self.space.section, way.space.section
            self._weights = coarse.shape_functions(own.mesh.locate_on(coarse.mesh, own.nodes))
        return self.space.extruded(self._weights @ nodal)

    def _carried_contact(self, way: "LoadPath", last: LoadState) -> FloatArray:
        """Forces on the nodes of the front, N/mm, of the pressure on coarser elements."""
        own, coarse = self.equilibrium.contact, way.equilibrium.contact
        if own is None or coarse is None:
            return self.equilibrium.rest.contact
        pressure = last.contact / coarse.lengths(last.nodal)
        at = np.interp(own.positions[:, 0], coarse.positions[:, 0], pressure)
        return np.outer(own.shares, at * own.lengths(self.interpolated(way, last.nodal))).ravel()

    def relaxed(self, kept: BoolArray) -> LoadState | None:
        """Equilibrium near the last one under the constraints of a mask alone; None if none is found."""
        last, constraints = self.points[-1], self.equilibrium.constraints
        self.equilibrium.constraints = constraints.only(kept)
        newton = self._begin()
        state = self._settled(newton, replace(last, forces=last.forces[kept]))
        newton.close()
        self.equilibrium.constraints = constraints
        return state

    def _stable(self, point: LoadState) -> LoadState:
        """The equilibrium or, if it is unstable, the lower of the stable ones to either side of it.

        Stability is judged by the tangent factorised last, at Newton's last guess. A cylinder's contact,
        whose multipliers would have to settle again, is left where it is.
        """
        equilibrium = self.equilibrium
        if not equilibrium.unstable or equilibrium.contact is not None:
            return point
        energy, found = equilibrium.energy_with_springs(point), []
        for start in aside(point.nodal, equilibrium.softest(), energy):
            lower = descended(start, energy, equilibrium.step_at(point))
            state = None if lower is None else self._settled(self._newton, replace(point, nodal=lower))
            if state is not None and not equilibrium.unstable:
                found.append(state)
        if not found:
            return point
        self.left += 1
        return min(found, key=lambda state: energy(state.nodal))

    def _settled(self, newton: ConstrainedNewton, guess: LoadState) -> LoadState | None:
        result = newton.solve(guess)
        self._iterations += result.iterations
        return result.state if result.converged else None

    def _found(self, guess: LoadState) -> tuple[LoadState | None, int]:
        """Equilibrium near a guess, None if there is none; iterations of the hardest solve."""
        contact, newton, apart, hardest = self.equilibrium.contact, self._newton, PENETRATION, 0
        rubs = contact is not None and contact.coefficient > 0  # friction depends on the way
        if self._rough is not None and guess.fraction < self._exact_from and not rubs:
            newton, apart = self._rough, ROUGH
        for _ in range(30):
            result = newton.solve(guess)
            self._iterations += result.iterations
            hardest, self._tangent = max(hardest, result.iterations), result.tangent
            if not result.converged:
                self._reason = f"SNES: {result.reason}"
                return None, hardest
            if contact is None:
                return result.state, hardest
            guess, off = contact.settled(result.state)
            if off <= apart:
                return guess, hardest
        self._reason = "the contact does not settle"
        return None, hardest

    def _guess(self, fraction: float) -> LoadState:
        """The state at a fraction of the load by extrapolation of the last ones."""
        last, contact = self.points[-1], self.equilibrium.contact
        if len(self.points) == 1:
            return self.equilibrium.linear_guess(fraction)
        friction = None if contact is None else contact.started(last)
        known = self.points[-3:]
        at = np.array([point.fraction for point in known])
        shares = [np.prod((fraction - (rest := np.delete(at, k))) / (at[k] - rest)) for k in range(len(at))]
        nodal = sum(share * point.nodal for share, point in zip(shares, known, strict=True))
        forces = sum(share * point.forces for share, point in zip(shares, known, strict=True))
        return LoadState(fraction, nodal, last.contact, forces, friction=friction)

    @property
    def phrase(self) -> str:
        """The steps taken, in words; where the path ends before the full load, with the reason."""
        if (fraction := self.points[-1].fraction) < 1:
            reason = self._snap or f"Newton's method fails beyond ({self._reason})"
            return f"stopped at {fraction:.1%} of the load: {reason}"
        steps = len(self.points) - 1
        return f"all of the load applied in {steps} steps, {self._iterations} Newton iterations"

    @property
    def advice(self) -> str:
        """Advice where the path ends before the full load."""
        if self._snap:
            return "the figures are of the finger just before; take a smaller stroke"
        wider = "a wider contact" if self.equilibrium.contact is None else "another radius"
        return f"take a finer mesh, {wider} or a smaller stroke"

    @property
    def _snap(self) -> str:
        """What the finger does where a path ends at the last equilibrium of its kind; else empty.

        Near a limit point the finger moves ever farther in a step. A finger that leaves a cylinder by itself
        has no force on it there.
        """
        steps = np.diff([point.fraction for point in self.points])
        if len(steps) < 3:
            return ""
        ahead = np.array([value or 0.0 for value in self.equilibrium.problem.load.displacement])
        stroke, last = np.linalg.norm(ahead), self.points[-1].fraction
        forces = np.array([self.reaction(point) for point in self.points]) @ ahead
        before, force = forces[-2:]
        if self.equilibrium.contact is not None and force < min(LET_GO * forces.max(), before):
            place = stroke * (last + max(force, 0.0) * steps[-1] / (before - force))
            return f"the finger snaps away from the cylinder at {place:.4g} mm, where the force falls to zero"
        moved = np.abs(np.diff([point.nodal for point in self.points], axis=0)).max(axis=(1, 2)) / steps
        if moved[-1] > LEAP * np.median(moved):
            return f"a limit point at {stroke * last:.4g} mm, beyond which the finger snaps to another shape"
        return ""

    @property
    def stats(self) -> dict[str, float | int | str]:
        """The number of steps and iterations."""
        return {
            "load_steps": len(self.points) - 1,
            "halved_steps": self._halved,
            "newton_iterations": self._iterations,
        }

    def history(self) -> dict[str, FloatArray]:
        """Fraction of the load, energy, N mm/mm, and reaction, N/mm, at every equilibrium.

        With the force's abscissa, mm, where there is a force, and width and pressure of a cylinder's contact.
        A state without a force, such as rest, has the abscissa of the next one.
        """
        reactions = np.array([self.reaction(point) for point in self.points])
        columns = {
            "load_fraction": np.array([point.fraction for point in self.points]),
            "energy": np.array([self.equilibrium.energy(point.nodal) for point in self.points]),
            "reaction_x": reactions[:, 0],
            "reaction_y": reactions[:, 1],
        }
        places = np.array([self.force_abscissa(point) for point in self.points], dtype=np.float64)
        if len(known := np.flatnonzero(np.isfinite(places))):
            following = np.searchsorted(known, np.arange(len(places))).clip(max=len(known) - 1)
            columns["force_abscissa_mm"] = places[known[following]]
        if self.equilibrium.contact is not None:
            touched = [region.stats() if region else {} for region in self.regions()]
            for name in ("contact_width_mm", "contact_pressure_MPa"):
                columns[name] = np.array([stats.get(name, 0.0) for stats in touched])
        return columns

    def reaction(self, point: LoadState) -> FloatArray:
        """Force of the indenter on the finger, shape (2,), N/mm."""
        return reaction_by_residual_work(self.space, self.equilibrium.internal_force(point.nodal))

    def force_abscissa(self, point: LoadState) -> float | None:
        """Abscissa before the load at which the indenter's force along y acts, mm; None without such a force.

        It differs from the contact's middle where the contact cannot turn, and holds the finger by a couple.
        """
        front = np.setdiff1d(self.space.boundary_nodes("front"), self.space.boundary_nodes("base"))
        forces = self.equilibrium.internal_force(point.nodal)[front, 1]
        total = float(forces.sum())
        return float(forces @ self.space.nodes[front, 0]) / total if total else None

    def states(self) -> list[FloatArray]:
        """Displacements of the nodes at every equilibrium, each of shape (N, d), mm."""
        return [point.nodal for point in self.points]

    def regions(self) -> list[ContactRegion | None]:
        """The contact region of every equilibrium; None without contact or without a cylinder."""
        contact = self.equilibrium.contact
        return [None if contact is None else ContactRegion.of(contact, point) for point in self.points]
