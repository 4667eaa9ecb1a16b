"""PETSc as it is started: the MPI of wheels, which nothing else finds, and signals."""

import os
import subprocess
import sys

from pinnray.runtime.processes.pool import child_environment
from pinnray.solvers.petsc import wheels_mpi


def test_the_mpi_beside_a_petsc_of_wheels_is_loaded(tmp_path):
    package = tmp_path / "lib" / "python3.13" / "site-packages" / "petsc4py" / "__init__.py"
    assert wheels_mpi(tmp_path, package) is None  # the environment has no MPI
    library = tmp_path / "lib" / "libmpi.so.12"
    library.parent.mkdir(exist_ok=True)
    library.touch()
    assert wheels_mpi(tmp_path, package) == library


def test_a_distributions_petsc_keeps_its_own_mpi(tmp_path):
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "libmpi.so.12").touch()
    assert wheels_mpi(tmp_path, tmp_path.parent / "dist-packages" / "petsc4py" / "__init__.py") is None


def test_a_closed_pipe_is_an_error_of_python_not_the_end_of_the_process():
    code = (
        "import os, pinnray.solvers.petsc\n"
        "reading_end, writing_end = os.pipe()\n"
        "os.close(reading_end)\n"
        "try:\n    os.write(writing_end, b'x')\n"
        "except BrokenPipeError:\n    print('told')\n"
    )
    environment = child_environment(os.environ)
    environment.pop("PETSC_OPTIONS", None)  # as of a notebook, which has no command to set it
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True)
    assert done.stdout == "told\n"
