"""Gaussian processes: `gp`; imports `solvers.assimilation`."""
