"""Manufactured solutions: the orders of convergence in displacement and energy.

Source: the method: P. J. Roache, Verification and Validation in Computational Science and Engineering,
Hermosa, 1998; the orders: G. Strang, G. J. Fix, An Analysis of the Finite Element Method, Prentice-Hall,
1973, chapter 3.
"""

from itertools import product

import numpy as np

from benchmarks.verification.boundary_value import BoundaryValue, Exact
from benchmarks.verification.cases.patch import BODY
from benchmarks.verification.hooke import PlaneLaw
from benchmarks.verification.meshes import mapped_mesh
from benchmarks.verification.record import Case, Row, about, slope_rows
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.problem import Material

WAVES = np.array([[1.9, 0.6], [1.1, -1.6]])
"""Wave vectors of the two components, 1/mm."""

PHASES = np.array([0.2, 0.9])
CELLS = (8, 16, 32)


def manufactured() -> tuple[Row, ...]:
    """Slopes between the two finest of three meshes."""
    rows = []
    for degree, plane in product((1, 2), ("strain", "stress")):
        material = Material(poisson=0.3, plane=plane)
        exact = waves(PlaneLaw.of(material))
        errors = []
        for cells in CELLS:
            problem = BoundaryValue(
                mapped_mesh(BODY, cells, cells),
                material,
                given={"left": (exact.displacement, (0, 1)), "bottom": (exact.displacement, (0, 1))},
                tractions={"right": exact.stress, "top": exact.stress},
                body_force=exact.body_force,
            )
            errors.append(problem.errors(problem.solve(degree), exact))
        rows += slope_rows(errors, degree, plane, about(degree + 1, 0.1), about(degree, 0.1))
    return tuple(rows)


def waves(law: PlaneLaw) -> Exact:
    """Displacements u_i = sin(k_i . x + φ_i) with the body force -div σ."""

    def phase(points: FloatArray) -> FloatArray:
        return points @ WAVES.T + PHASES

    def stress(points: FloatArray) -> FloatArray:
        return law.stress(np.cos(phase(points))[:, :, None] * WAVES)

    def body_force(points: FloatArray) -> FloatArray:
        second = -np.sin(phase(points))[:, :, None, None] * WAVES[:, :, None] * WAVES[:, None, :]
        return -sum(law.stress(second[..., axis])[:, :, axis] for axis in range(2))

    return Exact(lambda points: np.sin(phase(points)), stress, body_force)


MANUFACTURED = Case(name="manufactured solution", answer="chosen, with its body force", measure=manufactured)
