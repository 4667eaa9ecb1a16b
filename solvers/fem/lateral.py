"""Stiffness against a force out of the finger's plane and a torque about its axis, in three dimensions."""

from dataclasses import replace

import numpy as np

from pinnray.solvers.extrusion import ExtrudedSpace
from pinnray.solvers.fem.boundary_conditions import DisplacementConstraints
from pinnray.solvers.fem.equilibrium import DiscreteEquilibrium
from pinnray.solvers.problem import Load, Problem, contact_functional
from pinnray.solvers.solution import LateralStiffness


def lateral_stiffness(problem: Problem, space: ExtrudedSpace) -> LateralStiffness:
    """The sideways and the torsional stiffness at the contact, at rest, with one factorisation.

    Force and couple are spread over the contact as a `mean` load is, and evenly over the depth. The force
    acts along z, and its displacement is the mean of u_z. The couple acts about x by forces along y in
    proportion to z, so that it has no resultant, wherever its axis is; its turn is the slope of -u_y along z.
    Under the one the contact is free of the other. Both turn the finger's halves over, so that half of it
    is enough.
    """
    turned = replace(space, antisymmetric=True)
    material = problem.material.model_copy(update={"law": "linear"})
    rest = replace(problem, material=material, load=Load(position=problem.load.position), observations=None)
    size = turned.nodes.shape
    none = DisplacementConstraints(np.zeros((0, *size)), np.zeros(0), np.zeros(0))
    equilibrium = DiscreteEquilibrium(rest, turned, none)
    contact, functionals = contact_functional(rest), np.zeros((2, *size))
    functionals[0, :, 2] = turned.mean_value(*contact)
    functionals[1, :, 1] = -turned.slope_value(*contact)
    per_depth = (functionals * equilibrium.factors.solve_all(functionals)).sum(axis=(1, 2))
    equilibrium.factors.destroy()
    sideways, torsional = problem.mesh.depth / per_depth
    return LateralStiffness(float(sideways), float(torsional))
