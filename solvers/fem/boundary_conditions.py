"""The conditions at base and contact in a finite-element space, and the reaction there."""

import numpy as np

from geometry.arrays import BoolArray, FloatArray
from solvers.lagrange import LagrangeSpace
from solvers.problem import Problem, contact_functional


def held_components(problem: Problem, space: LagrangeSpace) -> BoolArray:
    """Nodal components that a Dirichlet condition prescribes, (N, 2): base and, for a `patch`, contact."""
    held = np.zeros((len(space.nodes), 2), dtype=bool)
    held[space.boundary_nodes("base")] = True
    if problem.load.kind == "patch":
        held[np.ix_(space.boundary_nodes("contact"), np.array(problem.load.prescribed))] = True
    return held


def patch_displacement(problem: Problem, space: LagrangeSpace) -> FloatArray:
    """Nodal displacements that are the load on the contact and zero elsewhere, shape (N, 2), mm."""
    values = np.zeros((len(space.nodes), 2))
    nodes = space.boundary_nodes("contact")
    values[np.ix_(nodes, np.array(problem.load.prescribed))] = problem.load.values
    return values


def load_functionals(problem: Problem, space: LagrangeSpace) -> FloatArray:
    """The load's functional on every shape function, one for each prescribed component, shape (k, N, 2)."""
    points, weights = contact_functional(problem)
    coefficients = space.shape_functions(problem.mesh.locate(points)).T @ weights
    functionals = np.zeros((len(problem.load.prescribed), len(space.nodes), 2))
    for row, axis in enumerate(problem.load.prescribed):
        functionals[row, :, axis] = coefficients
    return functionals


def reaction_by_residual_work(space: LagrangeSpace, residual: FloatArray) -> FloatArray:
    """Force of the indenter on the finger, shape (2,), N/mm: the work of the residual on a unit translation.

    The translation is one everywhere but at the base, where the clamp's own force works. Exact for the
    discrete solution, unlike an integral of stresses along the boundary.
    """
    moved = np.ones(len(space.nodes), dtype=bool)
    moved[space.boundary_nodes("base")] = False
    return np.asarray(residual[moved].sum(axis=0))
