"""Cook's membrane, against published values.

Source: plane stress: P. G. Bergan, C. A. Felippa, A triangular membrane element with rotational degrees of
freedom, Computer Methods in Applied Mechanics and Engineering 50 (1985) 25-69; plane strain: CoFEA, benchmark
002, <https://cofea.readthedocs.io>.
"""

import numpy as np

from benchmarks.verification.boundary_value import BoundaryValue, at_rest
from benchmarks.verification.meshes import mapped_mesh, quadrilateral
from benchmarks.verification.record import Case, Row, about
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.problem import Material

BODY = quadrilateral([(0, 0), (48, 44), (48, 60), (0, 44)])
MIDDLE, CORNER = (48.0, 52.0), (48.0, 60.0)
"""Of the loaded side."""

UNDER, OVER = (24.0, 22.0), (24.0, 52.0)
"""Middles of the lower and the upper side."""

CELLS = 64
CORNER_AT = {0.3333: 32.20, 0.4999: 27.52}
"""Published deflections of the upper corner in plane strain, mm, by Poisson's ratio."""


def cook() -> tuple[Row, ...]:
    """Deflections and principal stresses beside the published ones."""
    problem = membrane(Material(young=1.0, poisson=1 / 3, plane="stress"), total_force=1.0)
    where = problem.mesh.locate([MIDDLE, UNDER, OVER])
    rows = []
    for degree in (1, 2):
        field = problem.solve(degree)
        middle = field.displacement(where)[0, 1]
        rows.append(published("deflection of the loaded side's middle", middle, 23.9, 0.01, degree, "stress"))
    principal = np.linalg.eigvalsh(problem.state(field, where).stress)
    rows += [
        published("tension under the middle", principal[1, 1], 0.236, 0.015, degree, "stress"),
        published("compression over the middle", -principal[2, 0], 0.201, 0.015, degree, "stress"),
    ]
    for poisson, value in CORNER_AT.items():
        problem = membrane(Material(young=70.0, poisson=poisson), total_force=100.0)
        corner = problem.solve(2).displacement(problem.mesh.locate([CORNER]))[0, 1]
        name = f"deflection of the upper corner, mm, ν = {poisson}"
        rows.append(published(name, corner, value, 0.005))
    return tuple(rows)


def published(
    quantity: str, measured: float, value: float, part: float, degree: int = 2, plane: str = "strain"
) -> Row:
    """A row with a relative tolerance about a published number."""
    return Row(quantity, float(measured), about(value, part * value), degree, plane)


def membrane(material: Material, total_force: float) -> BoundaryValue:
    """The tapered panel, held at the left, sheared at the right by a total force upwards, N/mm."""
    shear = total_force / 16 * np.array([[0.0, 1.0], [1.0, 0.0]])

    def stress(points: FloatArray) -> FloatArray:
        return np.broadcast_to(shear, (len(points), 2, 2))

    mesh = mapped_mesh(BODY, CELLS, CELLS)
    return BoundaryValue(mesh, material, {"left": (at_rest, (0, 1))}, {"right": stress})


COOK = Case(name="Cook's membrane", answer="published values", measure=cook)
