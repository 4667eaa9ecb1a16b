"""Figures by which a designer judges a finger: their names, units and meanings, said once."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from pinnray.geometry.finger.finger import Finger
from pinnray.runtime.errors import UserError
from pinnray.solvers.finger_figures.measures import (
    Extreme,
    force_curve,
    front_ends,
    largest_away_from_corners,
    narrowest_gap,
    thinnest_wall,
    wrap_angle,
)
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.shared_work import shared
from pinnray.solvers.solution import Solution

if TYPE_CHECKING:
    from pinnray.solvers.fem.linear import FactorisedProblem

DENSITY = 1.2
"""Of a printed polyurethane, g/cm^3: where the substance is not known."""
NEAR_BREAK = 0.5
"""Largest strain over the strain at break from which a finger is said to be near it."""
NORMAL = 1.96
"""Half of a 95 % interval over the standard deviation."""

Interval = tuple[float, float]
Place = tuple[float, float]


class Quantity(NamedTuple):
    """A number that describes a finger under its load."""

    unit: str  #: Empty for a ratio
    meaning: str  #: A clause for tables and captions


def _figure(unit: str, meaning: str) -> Any:
    return field(default=float("nan"), metadata={"quantity": Quantity(unit, meaning)})


@dataclass(frozen=True, kw_only=True)
class FingerFigures:
    """What a finger does under its load. Numbers are NaN where the solver does not give them.

    Attributes:
        intervals: 95 % intervals by the names of the figures, where the solver knows them.
        places: Drawn points of the largest stress and strain, mm, by the names of these figures.
        curve: Travel of the indenter, mm, and its force along it, N, from rest on; one pair where the way to
            the end is not known.
        strain_over_break: Largest nominal strain over the material's strain at break, of a known material.
        strain_energy: Elastic energy of the whole finger, mJ.
    """

    force: float = _figure(
        "N", "force of the indenter at the full stroke, along the travel, for the whole depth"
    )
    force_25: float = _figure("N", "the same at 25 % of the stroke")
    force_50: float = _figure("N", "the same at 50 % of the stroke")
    force_75: float = _figure("N", "the same at 75 % of the stroke")
    tip_u: float = _figure("mm", "displacement of the front's tip along the finger")
    tip_v: float = _figure("mm", "displacement of the front's tip across it, positive toward the indenter")
    wrap: float = _figure("deg", "wrap angle: how far the front face folds around the indenter")
    compliance_along: float = _figure(
        "mm/N", "displacement of the contact along the finger per force, at rest"
    )
    compliance_across: float = _figure("mm/N", "displacement of the contact across it per force, at rest")
    von_mises: float = _figure(
        "MPa", "largest von Mises stress, a wall thickness away from corners and contact"
    )
    principal_strain: float = _figure("", "largest principal strain there")
    area: float = _figure("mm2", "area of the section")
    mass: float = _figure("g", "mass of the body")
    thinnest_wall: float = _figure("mm", "thinnest wall or rib")
    narrowest_gap: float = _figure("mm", "narrowest clear width of a cavity")
    strain_over_break: float = float("nan")
    strain_energy: float = float("nan")
    intervals: Mapping[str, Interval] = field(default_factory=dict)
    places: Mapping[str, Place] = field(default_factory=dict)
    curve: tuple[tuple[float, float], ...] = ()

    def force_at(self, stroke: float) -> float:
        """Force of the indenter, N, after a travel, mm; between computed equilibria it is interpolated.

        Raises:
            UserError: If the travel is longer than the load's, or the way to the end is not known.
        """
        travels, forces = np.array(self.curve).T
        if not 0 <= stroke <= travels[-1] * (1 + 1e-9):
            raise UserError(
                f"the force is known from 0 to {travels[-1]:.4g} mm, not at {stroke:g} mm; change the stroke"
            )
        if len(travels) == 1 and not np.isclose(stroke, travels[-1]):
            raise UserError(
                f"the force is known at {travels[-1]:.4g} mm only; fem and fem-nonlinear know the way there"
            )
        return float(np.interp(stroke, travels, forces))

    def values(self) -> dict[str, float]:
        """The numbers by the names of `QUANTITIES`."""
        return {name: getattr(self, name) for name in QUANTITIES}

    def columns(self) -> dict[str, float]:
        """The numbers by name and unit, such as `force_N`, with ends of intervals, as `force_low_N`."""
        found = {}
        for name, value in self.values().items():
            unit = heading(name).removeprefix(name)
            found[f"{name}{unit}"] = value
            for end, bound in zip(("low", "high"), self.intervals.get(name, ()), strict=False):
                found[f"{name}_{end}{unit}"] = bound
        if np.isfinite(self.strain_over_break):
            found["strain_over_break"] = self.strain_over_break
        return found | {"strain_energy_mJ": self.strain_energy}

    def rows(self) -> list[tuple[str, str, str]]:
        """What, how much with its unit and interval, and its meaning: a row for each figure that is known."""
        known = {name: value for name, value in self.values().items() if not np.isnan(value)}
        return [
            *(
                (name.replace("_", " "), self._said(name, value), self._meaning(name))
                for name, value in known.items()
            ),
            ("strain energy", f"{self.strain_energy:.4g} mJ", "elastic energy of the whole finger"),
        ]

    def _said(self, name: str, value: float) -> str:
        said = f"{value:.4g}"
        if (interval := self.intervals.get(name)) is not None:
            said += f" ({interval[0]:.4g} to {interval[1]:.4g})"
        return f"{said} {QUANTITIES[name].unit}".rstrip()

    def _meaning(self, name: str) -> str:
        meaning, place = QUANTITIES[name].meaning, self.places.get(name)
        return meaning if place is None else f"{meaning}: at ({place[0]:.3g}, {place[1]:.3g}) mm"


QUANTITIES: Mapping[str, Quantity] = {
    each.name: each.metadata["quantity"] for each in fields(FingerFigures) if "quantity" in each.metadata
}
"""Every quantity of a table, in its order."""
FRACTIONS = {"force_25": 0.25, "force_50": 0.5, "force_75": 0.75}
"""Points of the force-stroke curve, as fractions of the stroke."""


def heading(name: str, quantity: Quantity | None = None) -> str:
    """Column heading of a quantity: its name with the unit, such as `force_N`."""
    unit = (quantity or QUANTITIES[name]).unit.replace("/", "_per_")
    return f"{name}_{unit}" if unit else name


def break_warning(share: float) -> str:
    """A sentence if the largest strain is near the strain at break or beyond, by their ratio; else empty."""
    if not share >= NEAR_BREAK:
        return ""
    end = "it breaks" if share >= 1 else "a printed part breaks earlier than the data sheet says"
    return f"The largest strain is {share:.0%} of the material's strain at break: {end}."


def figures_of(solution: Solution, rest: Mapping[str, float] | None = None) -> FingerFigures:
    """The figures of a solution.

    Args:
        solution: Of a finger with a depth.
        rest: What `figures_at_rest` gives for its problem; it is computed if None.

    Raises:
        UserError: If the problem is of a body without a depth.
    """
    problem, depth = solution.problem, _finger(solution.problem).depth
    curve = force_curve(solution, depth)
    length, force = curve[-1]
    ways = {
        name: float(np.interp(share * length, *curve.T)) if len(curve) > 1 else float("nan")
        for name, share in FRACTIONS.items()
    }
    tip_u, tip_v = solution.displacement(front_ends(problem)[1:])[0]
    stress, strain = largest_away_from_corners(solution)
    return FingerFigures(
        force=float(force),
        **ways,
        tip_u=float(tip_u),
        tip_v=float(tip_v),
        wrap=wrap_angle(solution),
        von_mises=stress.value,
        principal_strain=strain.value,
        **(figures_at_rest(problem) if rest is None else rest),
        strain_over_break=_strain_over_break(problem.material, strain.value),
        strain_energy=float(solution.energy) * depth,
        intervals=_intervals(solution, depth, stress),
        places={
            name: (float(each.place[0]), float(each.place[1]))
            for name, each in (("von_mises", stress), ("principal_strain", strain))
            if np.isfinite(each.value)
        },
        curve=tuple((float(travel), float(size)) for travel, size in curve),
    )


def figures_at_rest(
    problem: Problem, *, density: float | None = None, solve: Callable[[Load], Solution] | None = None
) -> dict[str, float]:
    """The figures that do not depend on the load, by name: compliances, mass, area, walls and gaps.

    Solvers of one problem share them inside `SharedWork.used`.

    Args:
        problem: Its finger, its elastic constants and the place of its contact.
        density: Of the material, g/cm^3; its substance's, else `DENSITY`, if None.
        solve: Solves the linear problem under a load, where it is factorised already.
    """
    finger, position = _finger(problem), problem.load.position
    linear = problem.material.model_copy(update={"law": "linear"})
    if density is None:
        density = problem.material.substance.density if problem.material.substance else DENSITY

    def computed() -> dict[str, float]:
        along, across = _compliances(solve or _prepared(problem, linear).solve, position, finger.depth)
        return {
            "compliance_along": along,
            "compliance_across": across,
            "area": finger.section.area,
            "mass": finger.section.area * finger.depth * density / 1000,
            "thinnest_wall": thinnest_wall(finger.section),
            "narrowest_gap": narrowest_gap(finger.section),
        }

    depends_on = problem.mesh.digest, finger.digest, repr(linear), position, density
    return shared(("figures at rest", *depends_on), computed)


def _prepared(problem: Problem, linear: Material) -> "FactorisedProblem":
    from pinnray.solvers.fem.linear import FemSolver

    still = replace(problem, material=linear, load=Load(position=problem.load.position), observations=None)
    return FemSolver(estimate=False).prepare(still)


def _finger(problem: Problem) -> Finger:
    if problem.finger is None:
        raise UserError("figures are of a finger with a depth; this problem is of a plane body")
    return problem.finger


def _strain_over_break(material: Material, strain: float) -> float:
    """Nominal strain over the strain at break; the laws of finite strain have Green and Lagrange's strain."""
    if material.substance is None:
        return float("nan")
    nominal = strain if material.law == "linear" else np.sqrt(1 + 2 * strain) - 1
    return float(nominal / material.substance.strain_at_break)


def _intervals(solution: Solution, depth: float, stress: Extreme) -> dict[str, Interval]:
    """The 95 % intervals of force and stress that a solver knows."""
    found: dict[str, Interval] = {}
    if solution.identified is not None and (along := solution.identified.along) is not None:
        found["force"] = depth * along.low, depth * along.high
    known = solution.uncertainty
    if known is not None and known.von_mises is not None and np.isfinite(stress.value):
        half = NORMAL * float(known.von_mises(solution.problem.mesh.locate(stress.place[None]))[0])
        found["von_mises"] = max(stress.value - half, 0.0), stress.value + half
    return found


def _compliances(
    solve: Callable[[Load], Solution], position: float | None, depth: float
) -> tuple[float, float]:
    """Displacement of the contact per force on the whole depth, along and across the finger, mm/N.

    The force acts in one direction, and the contact is free in the other.
    """
    units = [Load(displacement=moved, position=position) for moved in ((1.0, 0.0), (0.0, 1.0))]
    stiffness = depth * np.array([solve(unit).reaction for unit in units])
    compliance = np.linalg.inv(stiffness)
    return float(compliance[0, 0]), float(compliance[1, 1])
