"""Gaussian processes: `gp` (markers only) and `statfem` (finite elements plus a model error).

Imports `solvers.assimilation`, `solvers.fem`.
"""
