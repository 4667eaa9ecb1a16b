"""A quarter of a plate with a circular hole under tension, against Kirsch.

Source: G. Kirsch, Zeitschrift des Vereines deutscher Ingenieure 42 (1898) 797-807; S. P. Timoshenko, J. N.
Goodier, Theory of Elasticity, 3rd edition, McGraw-Hill, 1970, article 35.
"""

from itertools import product

import numpy as np

from benchmarks.verification.boundary_value import BoundaryValue, Exact, at_rest
from benchmarks.verification.hooke import PlaneLaw
from benchmarks.verification.meshes import mapped_mesh
from benchmarks.verification.record import Case, Row, about, slope_rows
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.problem import Material

RADIUS, HALF_WIDTH = 1.0, 4.0
TENSION = 0.1
"""Along x, far from the hole, MPa."""

CELLS = (16, 32, 64)
EDGE = np.array([[0.0, RADIUS]])
PEAK = {1: about(3, 0.05), 2: about(3, 0.003)}


def plate_with_hole() -> tuple[Row, ...]:
    """Slopes between the two finest of three meshes, and the stress concentration on the finest."""
    measured = []
    for degree, plane in product((1, 2), ("strain", "stress")):
        material = Material(poisson=0.3, plane=plane)
        exact = kirsch(PlaneLaw.of(material))
        errors = []
        for cells in CELLS:
            problem = BoundaryValue(
                mapped_mesh(quarter, cells, cells),
                material,
                given={"bottom": (at_rest, (1,)), "top": (at_rest, (0,))},
                tractions={"right": exact.stress},
            )
            field = problem.solve(degree)
            errors.append(problem.errors(field, exact))
        peak = problem.state(field, problem.mesh.locate(EDGE)).stress[0, 0, 0] / TENSION
        measured += [
            *slope_rows(errors, degree, plane, about(2, 0.1), about(degree, 0.1)),
            Row("stress concentration", float(peak), PEAK[degree], degree, plane),
        ]
    return tuple(measured)


def quarter(square: FloatArray) -> FloatArray:
    """The unit square to the quarter plate, finer at the hole: s leads outwards, t from x to y."""
    s, angle = square[:, 0], 0.5 * np.pi * square[:, 1]
    ray = np.column_stack([np.cos(angle), np.sin(angle)])
    outer = ray * (HALF_WIDTH / ray.max(axis=1))[:, None]
    return RADIUS * ray + ((4**s - 1) / 3)[:, None] * (outer - RADIUS * ray)


def kirsch(law: PlaneLaw) -> Exact:
    """The solution of the infinite plate under tension along x."""
    shear, κ = law.modulus / (2 * (1 + law.ratio)), (3 - law.ratio) / (1 + law.ratio)

    def displacement(points: FloatArray) -> FloatArray:
        r, θ = np.hypot(*points.T) / RADIUS, np.arctan2(points[:, 1], points[:, 0])
        u = r * (κ + 1) * np.cos(θ) + 2 / r * ((1 + κ) * np.cos(θ) + np.cos(3 * θ)) - 2 / r**3 * np.cos(3 * θ)
        v = r * (κ - 3) * np.sin(θ) + 2 / r * ((1 - κ) * np.sin(θ) + np.sin(3 * θ)) - 2 / r**3 * np.sin(3 * θ)
        return TENSION * RADIUS / (8 * shear) * np.column_stack([u, v])

    def stress(points: FloatArray) -> FloatArray:
        q, θ = RADIUS**2 / (points**2).sum(axis=1), np.arctan2(points[:, 1], points[:, 0])
        radial = 0.5 * (1 - q) + 0.5 * (1 + 3 * q**2 - 4 * q) * np.cos(2 * θ)
        hoop = 0.5 * (1 + q) - 0.5 * (1 + 3 * q**2) * np.cos(2 * θ)
        shear = -0.5 * (1 - 3 * q**2 + 2 * q) * np.sin(2 * θ)
        polar = np.moveaxis(np.array([[radial, shear], [shear, hoop]]), 2, 0)
        basis = np.moveaxis(np.array([[np.cos(θ), np.sin(θ)], [-np.sin(θ), np.cos(θ)]]), 2, 0)
        return TENSION * basis.swapaxes(1, 2) @ polar @ basis

    return Exact(displacement, stress)


KIRSCH = Case(name="plate with a hole", answer="closed form", measure=plate_with_hole)
