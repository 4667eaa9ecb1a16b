"""The paper's training: two modified MLPs, its loss, Adam, checkpoints (preset `paper`).

Imports `solvers.pinn.threading`; nothing of `solvers.pinn.finite_basis`.
"""
