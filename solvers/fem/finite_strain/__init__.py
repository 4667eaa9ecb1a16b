"""`fem-nonlinear`: equilibrium at finite strain, contact, the load path and Newton's method.

Imports the shared modules of `solvers.fem`.
"""
