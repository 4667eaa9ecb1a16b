"""The inverse problem at finite strain by networks.

Imports `solvers.pinn.finite_basis`; nothing of `solvers.pinn.paper`.
"""
