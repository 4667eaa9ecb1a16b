"""Finite elements with DOLFINx: `fem`, its error estimate and refinement, `fem-asm`, `fem-3d`, `fem-id`.

Sub-package: `finite_strain` (`fem-nonlinear`). Imports `solvers.assimilation`, `solvers.identification`.
"""
