"""Figures by which a designer judges a finger: their names, units and meanings, said once."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, NamedTuple
from warnings import warn

import numpy as np

from pinnray.geometry.finger.finger import Finger
from pinnray.runtime.errors import UserError
from pinnray.solvers.finger_figures.measures import (
    Extreme,
    contact_arc,
    force_curve,
    front_ends,
    largest_away_from_corners,
    largest_strain,
    narrowest_gap,
    nodal_gradient,
    thinnest_wall,
    wrap_angle,
)
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.shared_work import shared
from pinnray.solvers.solution import Solution

DENSITY = 1.2
"""Of a printed polyurethane, g/cm^3: where the substance is not known."""
NEAR_BREAK = 0.5
"""Largest strain over the strain at break from which a finger is said to be near it."""
FRICTION, GRAVITY = 0.5, 9.81
"""Coefficient of friction where the load has none, that of printed fingers is 0.5 to 0.95, and m/s^2."""
NORMAL = 1.96
"""Half of a 95 % interval over the standard deviation."""

Interval = tuple[float, float]
Place = tuple[float, float]


class Quantity(NamedTuple):
    """A number that describes a finger under its load."""

    unit: str  #: Empty for a ratio
    meaning: str  #: A clause for tables and captions
    always: bool = True  #: Whether every converged solution has it


def _figure(unit: str, meaning: str, *, always: bool = True) -> Any:
    return field(default=float("nan"), metadata={"quantity": Quantity(unit, meaning, always)})


@dataclass(frozen=True, kw_only=True)
class FingerFigures:
    """What a finger does under its load. Numbers are NaN where the solver does not give them.

    Attributes:
        intervals: 95 % intervals by the names of the figures, where the solver knows them.
        places: Drawn points of the largest stress and strains, mm, by the names of these figures.
        curve: Stroke of the indenter, mm, and its force, N, from rest on; one pair where the way to the
            end is not known.
        straight: Whether the force is in proportion to the stroke.
    """

    force: float = _figure("N", "force of the indenter along its stroke, at its end, for the whole depth")
    tangential_force: float = _figure("N", "the same across the stroke, positive toward the tip")
    force_25: float = _figure("N", "force at 25 % of the stroke", always=False)
    force_50: float = _figure("N", "force at 50 % of the stroke", always=False)
    force_75: float = _figure("N", "force at 75 % of the stroke", always=False)
    lift: float = _figure(
        "kg", "mass that two such fingers hold by friction, 2 µ force / g; µ is the load's, else 0.5"
    )
    tip_u: float = _figure("mm", "displacement of the front's tip along the finger")
    tip_v: float = _figure("mm", "displacement of the front's tip across it, positive toward the indenter")
    wrap: float = _figure("deg", "wrap angle: how far the front face folds around the indenter")
    contact_angle: float = _figure(
        "deg", "angle of the cylinder between the ends of its contact", always=False
    )
    contact_length: float = _figure("mm", "length of the front that touches the cylinder", always=False)
    compliance_along: float = _figure(
        "mm/N", "displacement of the contact along the finger per force, at rest"
    )
    compliance_across: float = _figure("mm/N", "displacement of the contact across it per force, at rest")
    von_mises: float = _figure(
        "MPa", "largest von Mises stress, a wall thickness away from corners and contact"
    )
    principal_strain: float = _figure("", "largest principal strain there")
    peak_strain: float = _figure("", "largest principal strain of all nodes, corners included")
    peak_radius: float = _figure(
        "mm",
        "radius of the corner there; 0 at a sharp corner or edge, where it grows with finer elements",
        always=False,
    )
    strain_over_break: float = _figure(
        "", "peak strain, as a nominal one, over the material's strain at break: 1 breaks", always=False
    )
    area: float = _figure("mm2", "area of the section")
    mass: float = _figure("g", "mass of a body of this section and depth")
    thinnest_wall: float = _figure("mm", "thinnest wall or rib")
    narrowest_gap: float = _figure("mm", "narrowest clear width of a cavity")
    strain_energy: float = _figure("mJ", "elastic energy of the whole finger")
    intervals: Mapping[str, Interval] = field(default_factory=dict)
    places: Mapping[str, Place] = field(default_factory=dict)
    curve: tuple[tuple[float, float], ...] = ()
    straight: bool = False

    def force_at(self, stroke: float) -> float:
        """Force of the indenter, N, after a stroke, mm; between computed equilibria it is interpolated.

        That is warned of; the `stops` of a solver are fractions of the stroke at which it is computed.

        Raises:
            UserError: If the solver did not come so far, or knows the force at the end of the stroke alone.
        """
        travels, forces = np.array(self.curve).T
        if not 0 <= stroke <= travels[-1] * (1 + 1e-9):
            raise UserError(
                f"the force is known up to the last equilibrium, not at {stroke:g} mm; change the stroke"
            )
        if len(travels) == 1 and not np.isclose(stroke, travels[-1]):
            raise UserError(
                f"the force is known at {travels[-1]:.4g} mm only; fem and fem-nonlinear know the way there"
            )
        near = np.abs(travels - stroke).min() <= 1e-6 * travels[-1]
        if not (near or self.straight):
            after = int(np.searchsorted(travels, stroke))
            steps = f"{travels[after - 1]:.4g} and {travels[after]:.4g} mm"
            warn(f"the force at {stroke:g} mm is interpolated between steps at {steps}", stacklevel=2)
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
        return found

    def rows(self) -> list[tuple[str, str, str]]:
        """What, how much with its unit and interval, and its meaning: a row for each figure that is known."""
        found = []
        for name, (unit, meaning, _) in QUANTITIES.items():
            if np.isnan(value := getattr(self, name)):
                continue
            said = f"{value:.4g}"
            if (interval := self.intervals.get(name)) is not None:
                said += f" ({interval[0]:.4g} to {interval[1]:.4g})"
            if (place := self.places.get(name)) is not None:
                meaning += f": at ({place[0]:.3g}, {place[1]:.3g}) mm"
            found.append((name.replace("_", " "), f"{said} {unit}".rstrip(), meaning))
        return found


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


def break_answer(share: float, radius: float) -> str:
    """Whether a finger breaks, in a sentence.

    Args:
        share: Its `strain_over_break`.
        radius: Its `peak_radius`.
    """
    if np.isnan(share):
        return "Whether it breaks is not known: that takes a material with a known strain at break."
    said = f"The largest strain, corners included, is {share:.0%} of the material's strain at break"
    if share >= NEAR_BREAK:
        said += ": it breaks" if share >= 1 else ": a printed part breaks earlier than the data sheet says"
    if radius == 0:
        said += "; it is at a sharp corner or edge, where it grows with finer elements: round it"
    return f"{said}."


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
    (travels, forces), length = curve.T, float(np.linalg.norm(problem.load.values))
    force, known = float(forces[-1]), len(curve) > 1
    ways = {
        name: float(np.interp(share * length, travels, forces, right=np.nan)) if known else float("nan")
        for name, share in FRACTIONS.items()
    }
    tip_u, tip_v = solution.displacement(front_ends(problem)[1:])[0]
    gradient = nodal_gradient(solution)
    stress, strain = largest_away_from_corners(solution, gradient)
    peak, radius = largest_strain(solution, gradient)
    angle, touching = contact_arc(solution)
    return FingerFigures(
        force=force,
        tangential_force=solution.tangential_force,
        **ways,
        lift=_lift(problem.load, force),
        contact_angle=angle,
        contact_length=touching,
        tip_u=float(tip_u),
        tip_v=float(tip_v),
        wrap=wrap_angle(solution),
        von_mises=stress.value,
        principal_strain=strain.value,
        **(figures_at_rest(problem) if rest is None else rest),
        peak_strain=peak.value,
        peak_radius=radius,
        strain_over_break=_strain_over_break(problem.material, peak.value),
        strain_energy=float(solution.energy) * depth,
        intervals=_intervals(solution, depth, stress),
        places={
            name: (float(each.place[0]), float(each.place[1]))
            for name, each in (("von_mises", stress), ("principal_strain", strain), ("peak_strain", peak))
            if np.isfinite(each.value)
        },
        straight=problem.material.law == "linear" and len(curve) > 1,
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
        solved = solve
        if solved is None:
            from pinnray.solvers.fem.linear import FemSolver

            still = replace(problem, material=linear, load=Load(position=position), observations=None)
            solved = FemSolver(estimate=False).prepare(still).solve
        # The force acts in one direction, and the contact is free in the other.
        units = [Load(displacement=moved, position=position) for moved in ((1.0, 0.0), (0.0, 1.0))]
        compliance = np.linalg.inv(finger.depth * np.array([solved(unit).reaction for unit in units]))
        return {
            "compliance_along": float(compliance[0, 0]),
            "compliance_across": float(compliance[1, 1]),
            "area": finger.section.area,
            "mass": finger.section.area * finger.depth * density / 1000,
            "thinnest_wall": thinnest_wall(finger.section),
            "narrowest_gap": narrowest_gap(finger.section),
        }

    depends_on = problem.mesh.digest, finger.digest, repr(linear), position, density
    return shared(("figures at rest", *depends_on), computed)


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


def _lift(load: Load, force: float) -> float:
    """Mass that two fingers hold by friction, kg, each with a force, N."""
    return 2 * (load.friction or FRICTION) * max(force, 0.0) / GRAVITY


def _intervals(solution: Solution, depth: float, stress: Extreme) -> dict[str, Interval]:
    """The 95 % intervals of force and stress that a solver knows."""
    found: dict[str, Interval] = {}
    if (identified := solution.identified) is not None:
        for name in ("force", "tangential_force"):
            _, low, high = getattr(identified, name)
            found[name] = depth * low, depth * high
        low, high = (_lift(solution.problem.load, end) for end in found["force"])
        found["lift"] = low, high
    known = solution.uncertainty
    if known is not None and known.von_mises is not None and np.isfinite(stress.value):
        half = NORMAL * float(known.von_mises(solution.problem.mesh.locate(stress.place[None]))[0])
        found["von_mises"] = max(stress.value - half, 0.0), stress.value + half
    return found
