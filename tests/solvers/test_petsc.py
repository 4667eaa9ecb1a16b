"""The MPI of wheels, which nothing else finds."""

from solvers.petsc import wheels_mpi


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
