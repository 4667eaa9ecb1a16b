"""Friction of a rigid cylinder: a layer that is sheared, and Cattaneo and Mindlin's partial slip.

Source: K. L. Johnson, Contact Mechanics, Cambridge University Press, 1985, section 7.2.
"""

from dataclasses import replace

import numpy as np

from benchmarks.verification.cases.hertz import FINEST, INDENTATION, RADIUS, block
from benchmarks.verification.meshes import mapped_mesh
from benchmarks.verification.record import Case, Row, about, at_most
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.contact.contact_region import ContactRegion
from pinnray.solvers.fem.finite_strain.load_path import LoadPath
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.solution import ContactPoints
from pinnray.solvers.solver import silent

COEFFICIENT = 0.3
LAYER = Material(poisson=0.0, law="neo-hookean")
INCOMPRESSIBLE = Material(poisson=0.49, law="neo-hookean")
"""Cattaneo and Mindlin neglect that pressure moves a surface along itself, as it does not at 0.5."""
SHIFT = 0.007
"""Travel along the block after the indentation, mm: friction is then 0.4 of its limit."""


def friction() -> tuple[Row, ...]:
    """Forces on the layer over those of the closed forms; partial slip of the block."""
    sticking, slipping = pressed_layer(20.0), pressed_layer(60.0)
    elastic = middle_ratio(sticking) / (0.5 * np.tan(np.radians(20.0)))
    coulomb = middle_ratio(slipping) / COEFFICIENT
    return (
        Row("layer that sticks, friction / pressure / elastic", elastic, about(1, 0.03)),
        Row("layer that slips, friction / pressure / μ", coulomb, about(1, 1e-6)),
        *partial_slip(),
    )


def pressed_layer(direction: float) -> ContactPoints:
    """The contact of a layer under a nearly flat cylinder that travels at an angle, degrees."""
    layer = mapped_mesh(lambda square: square * [40.0, 1.0] - [0.0, 1.0], 160, 4)
    way = 0.02 * np.array([np.sin(np.radians(direction)), -np.cos(np.radians(direction))])
    load = Load(kind="cylinder", radius=500.0, displacement=(way[0], way[1]), friction=COEFFICIENT)
    contact = FemNonlinearSolver(max_iterations=50).solve(Problem(layer, LAYER, load)).contact
    assert contact is not None
    assert contact.points is not None
    return contact.points


def middle_ratio(points: ContactPoints) -> float:
    """Friction over pressure, mean over the middle half of the layer."""
    middle = np.abs(points.x - 20.0) < 4.0
    return float((points.friction[middle] / points.pressure[middle]).mean())


def partial_slip() -> tuple[Row, ...]:
    """Pressed without friction, then shifted along the block with it: width that sticks, and friction."""
    load = Load(kind="cylinder", radius=RADIUS, displacement=(0.0, -INDENTATION))
    region = shifted(Problem(block(), INCOMPRESSIBLE, load))
    points = region.points
    modulus = INCOMPRESSIBLE.young / (1 - INCOMPRESSIBLE.poisson**2)
    pressing, shear = -region.force[1], region.friction
    half = np.sqrt(4 * pressing * RADIUS / (np.pi * modulus))
    sticking = half * np.sqrt(1 - abs(shear) / (COEFFICIENT * pressing))
    x = points.x - 30.0 - 0.5 * (points.x[0] + points.x[-1] - 60.0)
    peak = COEFFICIENT * 2 * pressing / (np.pi * half)
    law = ellipse(x / half) - sticking / half * ellipse(x / sticking)
    away = np.sqrt(np.mean((np.abs(points.friction) / peak - law) ** 2))
    return (
        Row("friction / limit of friction", abs(shear) / (COEFFICIENT * pressing), about(0.4, 0.1)),
        Row(
            "width that sticks / that of Mindlin", region.sticking / 2 / sticking, about(1, FINEST / sticking)
        ),
        Row("friction less Mindlin's / μ peak pressure, rms", float(away), at_most(0.06)),
    )


def shifted(problem: Problem) -> ContactRegion:
    """The contact after the load of a problem and a shift along the block."""
    path: LoadPath = FemNonlinearSolver().path(problem, LagrangeSpace(problem.mesh, 2))
    path.follow(silent)
    contact = path.equilibrium.contact
    assert contact is not None
    assert path.points[-1].fraction == 1
    path.equilibrium.contact = replace(
        contact,
        centre=contact.centre + contact.travel,
        travel=np.array([SHIFT, 0.0]),
        coefficient=COEFFICIENT,
    )
    path.points = [replace(path.points[-1], fraction=fraction) for fraction in (-1.0, 0.0)]
    path.follow(silent)
    region = path.regions()[-1]
    path.close()
    assert region is not None
    assert path.points[-1].fraction == 1
    return region


def ellipse(x: FloatArray) -> FloatArray:
    """√(1 - x²), zero beyond 1."""
    return np.sqrt(np.maximum(1 - x**2, 0.0))


FRICTION = Case(name="cylinder with friction", answer="closed forms for small strain", measure=friction)
