"""Plane elasticity of the finger: one problem, many solvers, one kind of solution. Units: mm, N, MPa."""
