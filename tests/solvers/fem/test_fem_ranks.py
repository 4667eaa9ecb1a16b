"""The finite elements on two MPI ranks: where one leads the others, and where every rank runs the program."""

import json
import signal

import numpy as np
import pytest

from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Load, Material, Problem

pytestmark = pytest.mark.mpi


@pytest.fixture
def start(start_ranks, coarse_mesh, tmp_path):
    """`start(program)`: one of `rank_programs` on two ranks."""
    coarse_mesh.save(tmp_path / "mesh.npz")
    return lambda program: start_ranks(
        2, "-m", "tests.solvers.fem.rank_programs", program, str(tmp_path / "mesh.npz")
    )


@pytest.fixture(scope="module")
def expected(coarse_mesh):
    """Of `fem` and `fem-nonlinear` in this process."""
    stiff = Problem(coarse_mesh, Material(law="neo-hookean"), Load(displacement=(0.0, -2.0)))
    return [FemSolver().solve(Problem(coarse_mesh)), FemNonlinearSolver().solve(stiff)]


def reported(process, code, expected, mesh):
    """The report of a program that ends with a code, its solutions checked."""
    output, errors = process.communicate()
    assert process.returncode == code, errors
    report = json.loads(output)
    assert len(report["solutions"]) == len(expected)
    for (energy, displacement), solution in zip(report["solutions"], expected, strict=True):
        assert energy == pytest.approx(solution.energy, rel=1e-10)
        np.testing.assert_allclose(displacement, solution.displacement(mesh.markers), rtol=0, atol=1e-8)
    return report


@pytest.mark.slow
def test_rank_0_leads_and_all_solve(start, expected, coarse_mesh):
    """The numbers are those of one process; only a collective task is shared; processes started are free."""
    report = reported(start("solve"), 3, expected, coarse_mesh)
    assert report["sharing"] == [1, 2, 1]
    assert report["launcher"] == []


@pytest.mark.slow
def test_every_rank_may_run_the_whole_program(start, expected, coarse_mesh):
    assert reported(start("everywhere"), 0, expected[:1], coarse_mesh)["sharing"] == [2]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("program", "code", "said"),
    [
        ("refused", 2, "error: fem has the law linear"),  # bad input, seen by rank 0 alone
        ("failing_on_rank_0", 2, "error: no memory is left on rank 0"),  # rank 1 waits for it in MPI
        ("failing_on_rank_1", 2, "error: no memory is left on rank 1"),
        ("faulty", 1, "RuntimeError: a fault of the program"),
    ],
)
def test_an_error_on_one_rank_ends_all(start, program, code, said):
    process = start(program)
    _, errors = process.communicate(timeout=100)
    assert process.returncode == code
    # Open MPI 5 ends its own message with a zero byte.
    lines = [line for line in errors.replace("\0", "").splitlines() if line.startswith(said)]
    assert len(lines) == 1, errors


def test_an_interruption_ends_all(start):
    process = start("waiting")
    assert process.stdout.readline() == "waiting\n"
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=100)
    assert process.returncode != 0  # the launcher's own: Open MPI 4 says 1, whatever the ranks say
