"""`fem-3d`: the shared mesh extruded through the depth, its side face, and the solver.

Imports `solvers.fem.finite_strain` and the shared modules of `solvers.fem`.
"""
