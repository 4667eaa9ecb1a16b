"""Names of the refused expressions of `solvers`."""
