"""Finite elements with DOLFINx: `fem`, its error estimate and refinement; `fem-asm`.

Sub-packages: `finite_strain` (`fem-nonlinear`), `identification` (`fem-id`). Imports
`solvers.assimilation` and the modules of `solvers`.
"""
