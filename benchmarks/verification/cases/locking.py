"""Nearly incompressible material in plane strain: linear triangles lock, quadratic ones do not.

Source: why linear triangles lock: T. J. R. Hughes, The Finite Element Method, Prentice-Hall, 1987, chapter 4;
what quadratic ones may lose: I. Babuška, M. Suri, Locking effects in the finite element approximation of
elasticity problems, Numerische Mathematik 62 (1992) 439-463.
"""

from benchmarks.verification.cases.cantilever import TIP, cantilever_problem, deflection, end_loaded
from benchmarks.verification.record import Case, Row, about, at_most, between, slope_rows
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.solvers.fem.error_estimate import locking_factor
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Material, Problem

DEFLECTION = {0.3: about(0.946, 0.02), 0.45: about(0.892, 0.02), 0.499: at_most(0.35), 0.4999: at_most(0.15)}
"""Deflection with linear elements over the closed form, by Poisson's ratio."""


def locking() -> tuple[Row, ...]:
    """Deflections of the cantilever, the orders of P2, and the factor that the status of `fem` states."""
    rows = []
    for degree in (1, 2):
        for poisson, linear in DEFLECTION.items():
            expected = linear if degree == 1 else about(1, 2e-4)
            name = f"tip deflection / closed form, ν = {poisson}"
            rows.append(Row(name, tip(poisson, degree), expected, degree, "strain"))
    material = Material(poisson=0.4999)
    exact = end_loaded(material)
    problems = [cantilever_problem(material, cells) for cells in (16, 32)]
    errors = [problem.errors(problem.solve(2), exact) for problem in problems]
    rows += slope_rows(errors, 2, "strain", about(3, 0.3), about(2, 0.3), ", ν = 0.4999")
    for poisson in (0.3, 0.4999):
        ratio = finger_energy(poisson, 2, 0.5) / finger_energy(poisson, 2, 0.25)
        name = f"energy with 0.5 mm / with 0.25 mm elements, default finger, ν = {poisson}"
        rows.append(Row(name, ratio, between(1.0, 1.01)))
    usual = finger_excess(0.3)
    for poisson in (0.45, 0.48, 0.49):
        measured = finger_excess(poisson) / usual
        name = f"error in energy / error at ν = 0.3, default finger, ν = {poisson}"
        said = locking_factor(poisson)
        rows.append(Row(name, measured, about(round(said, 2), 0.25 * said), 1, "strain"))
    return tuple(rows)


def tip(poisson: float, degree: int) -> float:
    """Tip deflection of the cantilever with 8 cells over its depth, over that of the closed form."""
    material = Material(poisson=poisson)
    field = cantilever_problem(material, 8).solve(degree)
    return deflection(field) / float(end_loaded(material).displacement(TIP)[0, 1])


def finger_excess(poisson: float) -> float:
    """Relative energy difference of linear from quadratic elements, default finger, elements of 0.5 mm."""
    return finger_energy(poisson, 1, 0.5) / finger_energy(poisson, 2, 0.5) - 1


def finger_energy(poisson: float, degree: int, size: float) -> float:
    """Energy of the default finger in plane strain, N mm / mm; the element size in mm."""
    problem = Problem(finger_mesh(Design(), settings=MeshSettings(size=size)), Material(poisson=poisson))
    return FemSolver(degree=degree, estimate=False).solve(problem).energy


LOCKING = Case(name="nearly incompressible", answer="closed form of the cantilever", measure=locking)
