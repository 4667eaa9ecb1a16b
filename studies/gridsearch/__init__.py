"""The paper's grid search for a learning rate and a weight of the boundary conditions.

Imports `compare.evaluation`, `compare.figures`, `compare.runtime`.
"""
