"""Conditions at base, contact and markers in a finite-element space, and the reaction."""

import numpy as np

from geometry.arrays import BoolArray, FloatArray
from solvers.assimilation.misfit import Misfit
from solvers.extrusion import NodalSpace
from solvers.lagrange import LagrangeSpace
from solvers.problem import Problem, contact_functional


def dirichlet_mask(problem: Problem, space: NodalSpace) -> BoolArray:
    """Mask (N, d) of components with a Dirichlet condition: base, symmetry and, for a `patch`, contact."""
    held = space.mirrored.copy()
    held[space.boundary_nodes("base")] = True
    if problem.load.kind == "patch":
        held[np.ix_(space.boundary_nodes("contact"), np.array(problem.load.prescribed))] = True
    return held


def dirichlet_displacement(problem: Problem, space: NodalSpace) -> FloatArray:
    """Nodal displacements that the Dirichlet conditions prescribe, zero elsewhere, shape (N, d), mm."""
    values = np.zeros(space.nodes.shape)
    if problem.load.kind == "patch":
        nodes = space.boundary_nodes("contact")
        values[np.ix_(nodes, np.array(problem.load.prescribed))] = problem.load.values
    return values


def load_targets(problem: Problem) -> FloatArray:
    """Prescribed values of `load_functionals`, shape (k,), mm."""
    return problem.load.values if problem.load.kind in ("mean", "point") else np.zeros(0)


def load_functionals(problem: Problem, space: NodalSpace) -> FloatArray:
    """The functionals whose values a `mean` or `point` load prescribes, shape (k, N, d); else none."""
    if problem.load.kind not in ("mean", "point"):
        return np.zeros((0, *space.nodes.shape))
    coefficients = space.mean_value(*contact_functional(problem))
    functionals = np.zeros((len(problem.load.prescribed), *space.nodes.shape))
    for row, axis in enumerate(problem.load.prescribed):
        functionals[row, :, axis] = coefficients
    return functionals


def marker_functionals(misfit: Misfit, space: LagrangeSpace) -> FloatArray:
    """Functionals for the displacements u v u v ... of the m markers, shape (2 m, N, 2)."""
    points, weights = misfit.sampling()
    sampling = weights @ space.shape_functions(space.mesh.locate(points)).toarray()
    return np.kron(sampling, np.eye(2)).reshape(-1, len(space.nodes), 2)


def reaction_by_residual_work(space: NodalSpace, residual: FloatArray) -> FloatArray:
    """Force of the indenter on the finger, shape (2,), N/mm: the work of the residual on a unit translation.

    The translation is zero at the base, where the clamp's own force works. Unlike an integral of stresses
    along the boundary it is exact for the discrete solution.
    """
    moved = np.ones(len(space.nodes), dtype=bool)
    moved[space.boundary_nodes("base")] = False
    return np.asarray(residual[moved, :2].sum(axis=0))
