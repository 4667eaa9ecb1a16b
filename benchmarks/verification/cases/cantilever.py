"""An end-loaded cantilever against the closed form of plane elasticity.

Source: S. P. Timoshenko, J. N. Goodier, Theory of Elasticity, 3rd edition, McGraw-Hill, 1970, article 21; as
a benchmark: C. E. Augarde, A. J. Deeks, Finite Elements in Analysis and Design 44 (2008) 595-601.
"""

from itertools import product

import numpy as np

from benchmarks.verification.boundary_value import BoundaryValue, Exact
from benchmarks.verification.hooke import PlaneLaw
from benchmarks.verification.meshes import mapped_mesh, quadrilateral
from benchmarks.verification.record import Case, Row, about, at_most, between, slope_rows
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.lagrange import LagrangeField
from pinnray.solvers.problem import Material

LENGTH, DEPTH = 8.0, 2.0
FORCE = 0.01
"""Along y at the end, N/mm."""

TIP = np.array([[LENGTH, 0.0]])
ROWS = (8, 16, 32)
"""Cells over the depth; four times as many along the length."""

ORDER = {1: about(2, 0.1), 2: between(2.9, 3.5)}
TIP_ERROR = {1: at_most(5e-3), 2: at_most(1e-7)}


def cantilever() -> tuple[Row, ...]:
    """Slopes between the two finest of three meshes, and the deflection on the finest."""
    measured = []
    for degree, plane in product((1, 2), ("strain", "stress")):
        material = Material(poisson=0.3, plane=plane)
        exact = end_loaded(material)
        problems = [cantilever_problem(material, rows) for rows in ROWS]
        fields = [problem.solve(degree) for problem in problems]
        errors = [problem.errors(field, exact) for problem, field in zip(problems, fields, strict=True)]
        missing = abs(1 - deflection(fields[-1]) / exact.displacement(TIP)[0, 1])
        measured += [
            *slope_rows(errors, degree, plane, ORDER[degree], about(degree, 0.1)),
            Row("relative error of the tip deflection", missing, TIP_ERROR[degree], degree, plane),
        ]
    return tuple(measured)


def cantilever_problem(material: Material, rows: int) -> BoundaryValue:
    """The beam with exact displacements at its root and exact tractions elsewhere."""
    half = 0.5 * DEPTH
    body = quadrilateral([(0, -half), (LENGTH, -half), (LENGTH, half), (0, half)])
    exact = end_loaded(material)
    return BoundaryValue(
        mapped_mesh(body, 4 * rows, rows),
        material,
        given={"left": (exact.displacement, (0, 1))},
        tractions={"right": exact.stress},
    )


def deflection(field: LagrangeField) -> float:
    """Displacement along y of the middle of the end, mm."""
    return float(field.displacement(field.space.mesh.locate(TIP))[0, 1])


def end_loaded(material: Material) -> Exact:
    """The exact solution; the origin is the middle of the root, x runs along the axis."""
    law, inertia = PlaneLaw.of(material), DEPTH**3 / 12
    scale, ν = FORCE / (6 * law.modulus * inertia), law.ratio

    def displacement(points: FloatArray) -> FloatArray:
        x, y = points.T
        u = -y * ((6 * LENGTH - 3 * x) * x + (2 + ν) * (y**2 - DEPTH**2 / 4))
        v = 3 * ν * y**2 * (LENGTH - x) + (4 + 5 * ν) * DEPTH**2 * x / 4 + (3 * LENGTH - x) * x**2
        return scale * np.column_stack([u, v])

    def stress(points: FloatArray) -> FloatArray:
        x, y = points.T
        σ = np.zeros((len(points), 2, 2))
        σ[:, 0, 0] = -FORCE * (LENGTH - x) * y / inertia
        σ[:, 0, 1] = σ[:, 1, 0] = FORCE / (2 * inertia) * (DEPTH**2 / 4 - y**2)
        return σ

    return Exact(displacement, stress)


CANTILEVER = Case(name="end-loaded cantilever", answer="closed form", measure=cantilever)
