"""The paper's grid search: a sweep over learning rate and weight of the boundary conditions."""
