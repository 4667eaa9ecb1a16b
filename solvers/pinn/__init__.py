"""Physics-informed neural networks that minimise the potential energy, in PyTorch.

`finite_basis`: random hidden weights and an exact output layer. `paper`: the paper's training.
`assimilating`: both with the markers' misfit. `identification`: the inverse problem at finite strain.
Imports `geometry`, `solvers.assimilation` and the modules of `solvers` for problem, solution and solver;
nothing of `solvers.fem`.
"""
