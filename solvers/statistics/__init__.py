"""Gaussian processes: `gp` and `statfem`; imports `solvers.assimilation` and `solvers.fem`."""
