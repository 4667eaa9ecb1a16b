"""Patch tests: a state of constant stress on distorted elements.

Source: G. P. Bazeley, Y. K. Cheung, B. M. Irons, O. C. Zienkiewicz, Triangular elements in plate bending:
conforming and nonconforming solutions, Proceedings of the 1st Conference on Matrix Methods in Structural
Mechanics, Wright-Patterson Air Force Base, 1965.
"""

from itertools import product

import numpy as np

from benchmarks.verification.boundary_value import BoundaryValue, Exact
from benchmarks.verification.hooke import PlaneLaw
from benchmarks.verification.meshes import mapped_mesh, quadrilateral
from benchmarks.verification.record import Case, Row, at_most
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Load, Material, Problem

GRADIENT = np.array([[0.010, 0.004], [-0.007, 0.003]])
SIDES = ("left", "right", "bottom", "top")
BODY = quadrilateral([(0, 0), (2.2, -0.3), (2.0, 1.3), (-0.2, 1.0)])
ROUNDING = at_most(1e-11)


def patch_tests() -> tuple[Row, ...]:
    """The errors of three kinds of patch test."""
    rows = []
    for degree, plane in product((1, 2), ("strain", "stress")):
        material = Material(plane=plane)
        exact = uniform(PlaneLaw.of(material))
        everywhere = (exact.displacement, (0, 1))
        mesh = mapped_mesh(BODY, 6, 5)
        for kind, given in {
            "displacements given all round": dict.fromkeys(SIDES, everywhere),
            "tractions given on three sides": {"left": everywhere},
        }.items():
            tractions = {name: exact.stress for name in SIDES if name not in given}
            problem = BoundaryValue(mesh, material, given, tractions)
            error = max(problem.errors(problem.solve(degree), exact))
            rows.append(Row(f"error, {kind}", error, ROUNDING, degree, plane))
        rows.append(
            Row("error, bar pulled by `fem`, ν = 0", pulled_bar(degree, plane), ROUNDING, degree, plane)
        )
    return tuple(rows)


def uniform(law: PlaneLaw) -> Exact:
    """The displacement of constant gradient."""

    def stress(points: FloatArray) -> FloatArray:
        return np.broadcast_to(law.stress(GRADIENT[None]), (len(points), 2, 2))

    return Exact(lambda points: points @ GRADIENT.T, stress)


def pulled_bar(degree: int, plane: str) -> float:
    """The largest relative error in strain, reaction and energy of a bar without lateral contraction."""
    length, width, pull = 8.0, 3.0, 0.1
    mesh = mapped_mesh(quadrilateral([(0, 0), (width, 0), (width, length), (0, length)]), 3, 8)
    material = Material(poisson=0.0, plane=plane)
    solution = FemSolver(degree=degree, estimate=False).solve(
        Problem(mesh, material, Load(kind="patch", displacement=(0.0, pull)))
    )
    strain = pull / length
    force = material.young * strain * width
    gradient = solution.gradient(mesh.at_centroids()) - [[0, 0], [0, strain]]
    reaction = solution.reaction - [0, force]
    return float(
        max(
            np.abs(gradient).max() / strain,
            np.abs(reaction).max() / force,
            abs(solution.energy / (0.5 * force * pull) - 1),
        )
    )


PATCH = Case(name="patch test", answer="constant stress", measure=patch_tests)
