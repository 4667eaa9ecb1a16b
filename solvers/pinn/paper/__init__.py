"""The paper's training: two modified MLPs, its loss, Adam, checkpoints (preset `paper`).

Imports `solvers.pinn.threading`, `solvers.assimilation`; nothing of `solvers.pinn.finite_basis`.
"""
