"""The triangle mesh of every solver: Gmsh, element sizes, refinement, boundary, quadrature, point location.

Imports `geometry.finger` and `geometry.cad`.
"""
