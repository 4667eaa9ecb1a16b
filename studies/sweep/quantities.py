"""Quantities by which a designer judges a finger: their names, units, meanings and computation."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from compare.evaluation.evaluation import field_difference
from geometry.arrays import FloatArray
from geometry.finger.finger import Finger
from geometry.mesh.boundary import mean_thickness, singular_points
from geometry.mesh.quadrature import body_quadrature, edge_quadrature
from geometry.mesh.triangle_mesh import TriangleMesh
from geometry.section.section import Section
from geometry.section.thickness import cavity_widths, wall_thickness
from solvers.fem.linear import FactorisedProblem, FemSolver
from solvers.problem import Load, Problem, contact_ends, contact_functional, contact_nodes, front_points
from solvers.solution import Solution, State
from solvers.solver import Solver, TrainedSolver, solved, with_law

FRACTIONS = {"force_25": 0.25, "force_50": 0.5, "force_75": 0.75}
"""Points of the force-stroke curve, as fractions of the stroke."""

RAY_SPACING = 0.5
"""Distance of the points from which wall thickness and gaps are measured, mm."""


@dataclass(frozen=True)
class Quantity:
    """A number that describes a finger under its load.

    Attributes:
        unit: Its unit; empty for a ratio.
        meaning: A clause for tables and captions.
    """

    unit: str
    meaning: str


QUANTITIES: Mapping[str, Quantity] = {
    "force": Quantity("N", "force of the indenter at the full stroke, along the travel, for the whole depth"),
    "force_25": Quantity("N", "the same at 25 % of the stroke"),
    "force_50": Quantity("N", "the same at 50 % of the stroke"),
    "force_75": Quantity("N", "the same at 75 % of the stroke"),
    "tip_u": Quantity("mm", "displacement of the front's tip along the finger"),
    "tip_v": Quantity("mm", "displacement of the front's tip across it, positive toward the indenter"),
    "wrap": Quantity("deg", "wrap angle: how far the front face folds around the indenter"),
    "compliance_along": Quantity("mm/N", "displacement of the contact along the finger per force, at rest"),
    "compliance_across": Quantity("mm/N", "displacement of the contact across it per force, at rest"),
    "von_mises": Quantity("MPa", "largest von Mises stress, a wall thickness away from corners and contact"),
    "principal_strain": Quantity("", "largest principal strain there"),
    "area": Quantity("mm2", "area of the section"),
    "mass": Quantity("g", "mass of the body"),
    "thinnest_wall": Quantity("mm", "thinnest wall or rib"),
    "narrowest_gap": Quantity("mm", "narrowest clear width of a cavity"),
}
"""Every quantity, in the order of the tables."""

TRAINING: Mapping[str, Quantity] = {
    "rel_l2_displacement": Quantity("", "relative L2 difference of the displacement from that by fem"),
    "rel_energy": Quantity("", "signed relative difference of the energy from fem's"),
    "boundary_violation": Quantity("", "the larger of the next two over the stroke"),
    "base_violation": Quantity("mm", "root mean square of the displacement along the base"),
    "load_violation": Quantity("mm", "distance of the load's functional from its prescribed value"),
    "energy": Quantity("N_mm/mm", "elastic energy per depth"),
    "loss": Quantity("MPa", "last value of the total loss"),
    "epochs": Quantity("", "epochs trained"),
    "seconds": Quantity("s", "time of the training"),
}
"""What a training gives besides, compared with `fem`."""


def heading(name: str) -> str:
    """Column heading of a quantity: its name with the unit, such as `force_N`."""
    unit = {**QUANTITIES, **TRAINING}[name].unit.replace("/", "_per_")
    return f"{name}_{unit}" if unit else name


def quantities(
    finger: Finger, problem: Problem, solver: Solver, *, density: float
) -> tuple[Solution, dict[str, float]]:
    """Solve a problem and evaluate every quantity.

    Args:
        finger: The finger of the problem's mesh.
        problem: The problem; its material's law is replaced by one that the solver has.
        solver: The solver.
        density: Of the material, g/cm^3.

    Returns:
        The solution, and the quantities by the names of `QUANTITIES`; NaN where the solver does not give one.
    """
    linear = replace(problem, material=problem.material.model_copy(update={"law": "linear"}))
    plain = replace(solver, estimate=False) if isinstance(solver, FemSolver) else FemSolver(estimate=False)
    if isinstance(solver, FemSolver):
        prepared = plain.prepare(linear)
        solution = prepared.solve(problem.load)
    else:
        solution = solved(solver, replace(problem, material=with_law(problem.material, solver)))
        prepared = plain.prepare(replace(linear, load=Load(position=problem.load.position)))
    along, across = _compliances(prepared, problem.load.position, finger.depth)
    prepared.destroy()
    tip_u, tip_v = solution.displacement(_front_ends(problem)[1:])[0]
    stress, strain = largest_away_from_corners(solution)
    found = {
        **forces(solution, finger.depth),
        **{"tip_u": float(tip_u), "tip_v": float(tip_v), "wrap": wrap_angle(solution)},
        **{"compliance_along": along, "compliance_across": across},
        **{"von_mises": stress, "principal_strain": strain},
        **{"area": finger.section.area, "mass": finger.section.area * finger.depth * density / 1000},
        **{"thinnest_wall": thinnest_wall(finger.section), "narrowest_gap": narrowest_gap(finger.section)},
    }
    values = {name: found[name] for name in QUANTITIES}
    return solution, values | (training(solution) if isinstance(solver, TrainedSolver) else {})


def training(solution: Solution) -> dict[str, float]:
    """The quantities of `TRAINING`, for a solver that records its loss."""
    problem = solution.problem
    fem = FemSolver().solve(replace(problem, material=problem.material.model_copy(update={"law": "linear"})))
    rule = body_quadrature(problem.mesh)
    own, reference = (each.displacement(rule.location) for each in (solution, fem))
    base, load = boundary_violations(solution)
    return {
        "rel_l2_displacement": field_difference(own, reference, rule.weights).rel_l2,
        "rel_energy": float(solution.energy) / float(fem.energy) - 1,
        "boundary_violation": max(base, load) / float(np.linalg.norm(problem.load.values)),
        "base_violation": base,
        "load_violation": load,
        "energy": float(solution.energy),
        "loss": float(solution.history["total"][-1]),
        "epochs": float(solution.stats["epochs"]),
        "seconds": float(solution.stats["seconds"]),
    }


def boundary_violations(solution: Solution) -> tuple[float, float]:
    """Root mean square of the displacement along the base, and the error of the load's functional, mm."""
    problem = solution.problem
    points, lengths = edge_quadrature(problem.mesh, "base")
    squares = (solution.displacement(points) ** 2).sum(axis=1)
    contact, weights = contact_functional(problem)
    mean = (weights @ solution.displacement(contact))[problem.load.prescribed]
    return (
        float(np.sqrt(lengths @ squares / lengths.sum())),
        float(np.linalg.norm(mean - problem.load.values)),
    )


def forces(solution: Solution, depth: float) -> dict[str, float]:
    """The force of the indenter along its travel at the full stroke and at `FRACTIONS` of it, N.

    The linear law has a straight line; a solver that records its path is interpolated linearly; any other one
    has NaN along the way.
    """
    load = solution.problem.load
    travel = np.array([value or 0.0 for value in load.displacement])
    ahead = depth * travel / np.linalg.norm(travel)
    last = float(solution.reaction @ ahead)
    history = solution.history
    fractions = np.array(list(FRACTIONS.values()))
    if {"load_fraction", "reaction_x", "reaction_y"} <= history.keys():
        path = np.stack([history["reaction_x"], history["reaction_y"]], axis=1) @ ahead
        curve = np.interp(fractions, [0.0, *history["load_fraction"]], [0.0, *path])
    elif solution.problem.material.law == "linear":
        curve = fractions * last
    else:
        curve = np.full(len(fractions), np.nan)
    return {"force": last, **dict(zip(FRACTIONS, map(float, curve), strict=True))}


def wrap_angle(solution: Solution) -> float:
    """By how many degrees the front face folds around the indenter.

    The front's end at the base, the contact's middle and the front's end at the tip are joined by two chords.
    The wrap angle is what the load adds to the turn from the first chord to the second: positive if the tip
    comes around the indenter, negative if it gives way more than the chord before the contact does. A finger
    that moves as a rigid body has none.
    """
    before = kink_points(solution.problem)
    after = before + solution.displacement(before)
    return turn(after) - turn(before)


def largest_away_from_corners(solution: Solution) -> tuple[float, float]:
    """The largest von Mises stress, MPa, and principal strain at nodes away from singular points.

    At sharp corners both grow without bound as elements shrink. Nodes nearer than the body's mean wall
    thickness to a re-entrant corner, an end of the base or the contact do not count. The displacement
    gradient at a node is the mean over its triangles, weighted by their areas, so that the numbers depend
    little on where the mesher puts its nodes. NaN if no node counts.
    """
    problem = solution.problem
    mesh = problem.mesh
    singular = np.concatenate([singular_points(mesh), mesh.points[contact_nodes(problem)]])
    far = cKDTree(singular).query(mesh.points)[0] > mean_thickness(mesh)
    if not far.any():
        return np.nan, np.nan
    state = State.from_gradient(_nodal_gradient(solution)[far], problem)
    return float(state.von_mises.max()), float(np.linalg.eigvalsh(state.strain)[:, -1].max())


def thinnest_wall(section: Section) -> float:
    """Thickness of the thinnest wall or rib, mm; see `geometry.section.thickness`."""
    return float(wall_thickness(section, RAY_SPACING)[1].min(initial=np.inf))


def narrowest_gap(section: Section) -> float:
    """Smallest clear width of a cavity, mm, by the same rays across the cavity; infinite without cavities."""
    return float(cavity_widths(section, RAY_SPACING)[1].min(initial=np.inf))


def _compliances(prepared: FactorisedProblem, position: float | None, depth: float) -> tuple[float, float]:
    """Displacement of the contact per force on the whole depth, along and across the finger, mm/N.

    The force acts in one direction, and the contact is free in the other.
    """
    units = (
        Load(displacement=(1.0, 0.0), position=position),
        Load(displacement=(0.0, 1.0), position=position),
    )
    stiffness = depth * np.array([prepared.solve(unit).reaction for unit in units])
    compliance = np.linalg.inv(stiffness)
    return float(compliance[0, 0]), float(compliance[1, 1])


def _nodal_gradient(solution: Solution) -> FloatArray:
    """The displacement gradient at the mesh's nodes, mean over their triangles, shape (n, 2, 2)."""
    mesh: TriangleMesh = solution.problem.mesh
    corners = solution.gradient(mesh.at_barycentric(np.eye(3))).reshape(-1, 4)
    nodes, weights = mesh.triangles.ravel(), np.repeat(mesh.areas, 3)
    count = len(mesh.points)
    sums = [np.bincount(nodes, weights * column, count) for column in corners.T]
    return np.asarray(
        (np.stack(sums, axis=1) / np.bincount(nodes, weights, count)[:, None]).reshape(-1, 2, 2)
    )


def _front_ends(problem: Problem) -> FloatArray:
    """The front's ends at base and tip, shape (2, 2), mm."""
    nodes = problem.mesh.points[np.unique(problem.mesh.boundary("front"))]
    return nodes[[nodes[:, 0].argmin(), nodes[:, 0].argmax()]]


def kink_points(problem: Problem) -> FloatArray:
    """The front's end at the base, the contact's middle and the front's end at the tip, shape (3, 2), mm."""
    base, tip = _front_ends(problem)
    middle = front_points(problem.mesh, np.array([0.5 * sum(contact_ends(problem))]))
    return np.concatenate([[base], middle, [tip]])


def turn(points: FloatArray) -> float:
    """Angle from the chord between the first two of three points to that between the last two, degrees."""
    (x0, y0), (x1, y1) = np.diff(points, axis=0)
    return float(np.degrees(np.arctan2(x0 * y1 - y0 * x1, x0 * x1 + y0 * y1)))
