"""Finite elements with DOLFINx: the linear reference and the finite-strain solver."""
