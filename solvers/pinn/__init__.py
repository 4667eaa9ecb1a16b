"""Physics-informed neural networks that minimise the potential energy, in PyTorch.

`finite_basis`: windows or gates and an exact output layer, hidden weights random or trained. `paper`: the
paper's training. Both also with the markers' misfit. `identification`: the inverse problem at finite strain.
Imports `geometry`, `solvers.assimilation` and the modules of `solvers` for problem, solution and solver;
nothing of `solvers.fem`.
"""
