"""`fem-nonlinear` against homogeneous deformations and against equilibrium in scikit-fem.

Source: the laws: J. Bonet, R. D. Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, 2nd
edition, Cambridge University Press, 2008, section 6.4.
"""

import numpy as np
import skfem

from benchmarks.verification.cases.another_program import basis_of, components, factorised
from benchmarks.verification.hyperelastic import Hyperelastic
from benchmarks.verification.meshes import mapped_mesh, quadrilateral
from benchmarks.verification.record import Case, Row, at_most
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.solution import Solution

LAWS = ("neo-hookean", "st-venant-kirchhoff")
LENGTH = 5.0


def finite_strain() -> tuple[Row, ...]:
    """Errors of homogeneous deformations, and differences from the other program's equilibrium."""
    rows = []
    for law in LAWS:
        # One row of cells: clamp and patch hold all nodes of P1.
        sheared = mapped_mesh(quadrilateral([(0, 0), (2, 0), (2.9, LENGTH), (0.7, LENGTH)]), 4, 1)
        error = homogeneous(sheared, Material(law=law), (0.5, 0.3), degree=1)
        name = f"error, stretch of 1.3 with shear of 0.5, {law}"
        rows.append(Row(name, error, at_most(1e-9), 1, "strain"))
        bar = mapped_mesh(quadrilateral([(0, 0), (2, 0), (2, LENGTH), (0, LENGTH)]), 4, 5)
        for degree in (1, 2):
            error = homogeneous(bar, Material(law=law, poisson=0.0), (0.0, 0.3), degree)
            name = f"error, bar stretched by 1.3, ν = 0, {law}"
            rows.append(Row(name, error, at_most(1e-9), degree, "strain"))
    for law in LAWS:
        moved, energy, force = equilibrium_elsewhere(law)
        rows += [
            Row(f"distance from scikit-fem's solution, finger, {law}", moved, at_most(1e-8)),
            Row(f"difference of the energy, finger, {law}", energy, at_most(1e-8)),
            Row(f"difference of the force, finger, {law}", force, at_most(1e-8)),
        ]
    return tuple(rows)


def homogeneous(mesh: TriangleMesh, material: Material, change: tuple[float, float], degree: int) -> float:
    """The largest relative error where every point moves by `change` times its ordinate."""
    load = Load(kind="patch", displacement=(change[0] * LENGTH, change[1] * LENGTH))
    solution = FemNonlinearSolver(degree=degree).solve(Problem(mesh, material, load))
    law, area = Hyperelastic.of(material), mesh.areas.sum()
    deformation = np.eye(3)
    deformation[:2, 1] += change
    stress, nominal = law.cauchy_stress(deformation), law.nominal_stress(deformation)
    # The work of the nominal stress on a unit translation of the patch, whose gradient is 1/LENGTH along y.
    force = nominal[:2, 1] * area / LENGTH
    state = solution.state(mesh.at_centroids())
    return float(
        max(
            np.abs(solution.gradient(mesh.at_centroids()) + np.eye(2) - deformation[:2, :2]).max(),
            np.abs(state.stress - stress[:2, :2]).max() / np.abs(stress).max(),
            np.abs(state.stress_zz - stress[2, 2]).max() / np.abs(stress).max(),
            np.abs(solution.reaction - force).max() / np.abs(force).max(),
            abs(solution.energy / (law.energy_density(deformation) * area) - 1),
        )
    )


def equilibrium_elsewhere(law: str) -> tuple[float, float, float]:
    """Takes one Newton step of scikit-fem from our solution for a finger.

    Returns:
        The largest displacement of the step and the differences in energy and in force, relative.
    """
    mesh = finger_mesh(Design(), settings=MeshSettings(size=1.0))
    material = Material(law=law)
    problem = Problem(mesh, material, Load(kind="patch", displacement=(None, -10.0)))
    solution = FemNonlinearSolver().solve(problem)
    basis, clamped, pressed = basis_of(mesh, 2)
    nodal = nodal_values(basis, solution)
    elastic = Hyperelastic.of(material)
    # Tensors are scikit-fem's first two axes.
    gradient = np.moveaxis(basis.interpolate(nodal).grad, (0, 1), (-2, -1))
    deformation = np.eye(2) + gradient
    stress = np.moveaxis(elastic.nominal_stress(deformation), (-2, -1), (0, 1))
    units = np.eye(4).reshape(2, 2, 2, 2)
    tangent = np.array([[elastic.change_of_stress(deformation, unit) for unit in row] for row in units])
    internal = skfem.LinearForm(lambda v, w: np.einsum("ij...,ij...", stress, v.grad)).assemble(basis)
    stiffness = skfem.BilinearForm(
        lambda u, v, w: np.einsum("kl...ij,kl...,ij...->...", tangent, u.grad, v.grad)
    ).assemble(basis)
    held = pressed.all("u^2")
    free = np.setdiff1d(np.arange(basis.N), np.union1d(clamped, held))
    step = factorised(stiffness.tocsc(), free).solve(-internal[free])
    energy = (elastic.energy_density(deformation) * basis.dx).sum()
    return (
        float(np.abs(step).max() / np.abs(nodal).max()),
        abs(solution.energy / energy - 1),
        float(abs(solution.reaction[1] / internal[held].sum() - 1)),
    )


def nodal_values(basis: skfem.Basis, solution: Solution) -> FloatArray:
    """The displacement of a solution in scikit-fem's degrees of freedom."""
    nodal = np.zeros(basis.N)
    for axis, dofs in enumerate(components(basis)):
        nodal[dofs] = solution.displacement(basis.doflocs[:, dofs].T)[:, axis]
    return nodal


FINITE_STRAIN = Case(
    name="finite strain", answer="closed forms; equilibrium in scikit-fem", measure=finite_strain
)
