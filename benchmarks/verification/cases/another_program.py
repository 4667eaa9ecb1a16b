"""`fem` against an independent solution by scikit-fem on the default finger's mesh.

Source: T. Gustafsson, G. D. McBain, scikit-fem: A Python package for finite element assembly, Journal of Open
Source Software 5 (2020) 2369.
"""

from itertools import product

import numpy as np
import skfem
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import SuperLU, splu
from skfem.models.elasticity import linear_elasticity

from benchmarks.verification.record import Case, Row, at_most
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Load, Material, Problem, contact_functional

LOADS = ("mean", "point", "patch")


def another_program() -> tuple[Row, ...]:
    """Returns the largest differences over the three loads."""
    mesh = finger_mesh(Design())
    rows = []
    for degree, plane in product((1, 2), ("strain", "stress")):
        differences = []
        for kind in LOADS:
            problem = Problem(mesh, Material(plane=plane), Load(kind=kind))
            ours = FemSolver(degree=degree, estimate=False).solve(problem)
            nodes, displacement, energy = scikit_fem(problem, degree)
            away = np.abs(ours.displacement(nodes) - displacement).max() / np.abs(displacement).max()
            differences.append((away, abs(ours.energy / energy - 1)))
        away, energy = np.max(differences, axis=0)
        rows += [
            Row("difference of the displacement, max norm", float(away), at_most(1e-8), degree, plane),
            Row("difference of the energy", float(energy), at_most(1e-8), degree, plane),
        ]
    return tuple(rows)


def scikit_fem(problem: Problem, degree: int) -> tuple[FloatArray, FloatArray, float]:
    """Nodes (n, 2), mm, their displacements (n, 2), mm, and the energy, N mm / mm."""
    basis, clamped, pressed = basis_of(problem.mesh, degree)
    lame = problem.material.lame
    stiffness = skfem.asm(linear_elasticity(lame.λ, lame.μ), basis).tocsc()
    moved = np.zeros(basis.N)
    if problem.load.kind == "patch":
        for name, value in zip("12", problem.load.values, strict=True):
            moved[pressed.all(f"u^{name}")] = value
        clamped = np.union1d(clamped, pressed.flatten())
    free = np.setdiff1d(np.arange(basis.N), clamped)
    factors = factorised(stiffness, free)
    if problem.load.kind == "patch":
        moved[free] = factors.solve(-(stiffness @ moved)[free])
    else:
        points, weights = contact_functional(problem)
        # Rows of the probing matrix are the components at the points, the points running fastest.
        functionals = np.kron(np.eye(2), weights) @ basis.probes(points.T)
        responses = factors.solve(functionals.T[free])
        forces = np.linalg.solve(functionals[:, free] @ responses, problem.load.values)
        moved[free] = responses @ forces
    energy = 0.5 * float(moved @ (stiffness @ moved))
    u, v = components(basis)
    return basis.doflocs[:, u].T, np.column_stack([moved[u], moved[v]]), energy


def basis_of(mesh: TriangleMesh, degree: int) -> tuple[skfem.Basis, IntArray, skfem.DofsView]:
    """scikit-fem's elements on a finger, its degrees of freedom at the base and those at the contact."""
    scalar = skfem.ElementTriP1() if degree == 1 else skfem.ElementTriP2()
    basis = skfem.Basis(
        skfem.MeshTri(mesh.points.T.copy(), mesh.triangles.T.copy()), skfem.ElementVector(scalar)
    )
    contact = mesh.points[mesh.boundary("contact").ravel(), 0]
    clamped = basis.get_dofs(lambda x: np.isclose(x[0], 0)).flatten()
    pressed = basis.get_dofs(lambda x: np.isclose(x[1], 0) & (x[0] > contact.min()) & (x[0] < contact.max()))
    return basis, clamped, pressed


def components(basis: skfem.Basis) -> tuple[IntArray, IntArray]:
    """The degrees of freedom along x and along y, node by node."""
    u, v = (basis.get_dofs(elements=True).all(name) for name in ("u^1", "u^2"))
    return u, v


def factorised(matrix: csc_matrix, free: IntArray) -> SuperLU:
    """The factors of the free part of a symmetric matrix."""
    return splu(matrix[np.ix_(free, free)], permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})


ANOTHER_PROGRAM = Case(name="another program", answer="that of scikit-fem", measure=another_program)
