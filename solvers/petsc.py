"""PETSc, started without the option files that it reads from the working folder and from home.

A `.petscrc` of others in the working folder could make it load a library or write any file. The variable
`PETSC_OPTIONS` counts.
"""

import petsc4py

petsc4py.init(["", "-skip_petscrc"])

from petsc4py import PETSc  # noqa: E402

__all__ = ["PETSc"]
