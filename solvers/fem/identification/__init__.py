"""`fem-id`: parameters of the finger and its load from the markers.

Imports `solvers.fem`, `solvers.fem.finite_strain`, `solvers.assimilation`.
"""
