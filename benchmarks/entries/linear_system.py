"""The solution of a problem from an assembled stiffness: what the adapters of elements share."""

import time
from collections.abc import Sequence

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.solvers.lagrange import LagrangeField, LagrangeSpace
from pinnray.solvers.problem import Problem, contact_functional
from pinnray.solvers.solution import Solution, Status


def solved_directly(
    name: str, problem: Problem, space: LagrangeSpace, stiffness: csc_matrix, started: float
) -> Solution:
    """Solve by a direct solver for the loads `mean`, `point` and `patch`.

    The stiffness has the degree of freedom 2 n + i for component i of node n.
    """
    load, axes = problem.load, problem.load.prescribed
    moved, clamped = np.zeros(2 * len(space.nodes)), dofs(space.boundary_nodes("base"), (0, 1))
    if load.kind == "patch":
        contact = space.boundary_nodes("contact")
        for axis in axes:
            moved[2 * contact + axis] = load.displacement[axis]
        clamped = np.union1d(clamped, dofs(contact, axes))
    free = np.setdiff1d(np.arange(len(moved)), clamped)
    matrix = stiffness[free][:, free].tocsc()
    factors = splu(matrix, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    reaction = np.zeros(2)
    if load.kind == "patch":
        moved[free] = factors.solve(-(stiffness @ moved)[free])
        reaction[axes] = (stiffness @ moved).reshape(-1, 2)[contact].sum(axis=0)[axes]
    else:
        at_nodes = space.mean_value(*contact_functional(problem))
        functionals = np.zeros((len(moved), len(axes)))
        for column, axis in enumerate(axes):
            functionals[axis::2, column] = at_nodes
        influence = factors.solve(functionals[free])
        forces = np.linalg.solve(functionals[free].T @ influence, load.values)
        moved[free], reaction[axes] = influence @ forces, forces
    energy = 0.5 * float(moved @ (stiffness @ moved))
    stats = {"seconds": time.perf_counter() - started, "unknowns": len(free)}
    field = LagrangeField(space, moved.reshape(-1, 2))
    return Solution(name, problem, field, energy, reaction, Status(True, "solved directly"), stats)


def dofs(nodes: IntArray, axes: Sequence[int]) -> IntArray:
    """Degrees of freedom of components of nodes."""
    return np.concatenate([2 * nodes + axis for axis in axes])


def interleaved(matrix: csc_matrix, dofs_of_nodes: FloatArray) -> csc_matrix:
    """A stiffness in the order of `solved_directly`, for a library that has its own: dofs (2, N)."""
    order = dofs_of_nodes.T.ravel()
    return matrix[order][:, order]
