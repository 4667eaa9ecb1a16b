"""PETSc, started without the option files that it reads from the working folder and from home.

A `.petscrc` of others in the working folder could make it load a library or write any file. The variable
`PETSC_OPTIONS` counts.

The wheels of DOLFINx do not find the MPI that the wheel `mpich` has put into the environment: it is loaded
for them.
"""

import ctypes
import os
import sys
from pathlib import Path
from tempfile import gettempdir

import petsc4py

from pinnray.runtime.cache import share_cache


def wheels_mpi(prefix: Path, package: Path) -> Path | None:
    """The MPI library of an environment whose PETSc is a wheel, too; None for a distribution's PETSc.

    Args:
        prefix: Folder of the environment.
        package: A file of petsc4py.
    """
    library = prefix / "lib" / "libmpi.so.12"
    return library if package.is_relative_to(prefix) and library.is_file() else None


if (mpi := wheels_mpi(Path(sys.prefix), Path(petsc4py.__file__))) is not None:
    ctypes.CDLL(str(mpi), mode=ctypes.RTLD_GLOBAL)

if "TMPDIR" in os.environ:
    os.environ["TMPDIR"] = gettempdir()  # or MPI ends the process where that cannot be written

share_cache()  # DOLFINx, which is imported after this, asks for the folder of its cache only then

# Its handler of signals would end the process at a closed pipe.
petsc4py.init(["", "-skip_petscrc", "-no_signal_handler"])

from petsc4py import PETSc  # noqa: E402

__all__ = ["PETSc"]
