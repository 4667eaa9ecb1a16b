"""Programs that the tests run on MPI ranks: `python -m tests.solvers.fem.rank_programs PROGRAM MESH.npz`.

Like `compare`, a program imports a solver only where it needs it: on rank 0, before the others do.
"""

import json
import os
import sys
import time
from functools import partial
from pathlib import Path

from mpi4py import MPI

from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.errors import UserError
from pinnray.solvers.fem import ranks
from pinnray.solvers.fem.ranks import communicator, lead, on_all_ranks
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solution import Solution

ranks.PATIENCE_S = 0.5  # for ranks that never come
RANK = MPI.COMM_WORLD.rank
MESH = TriangleMesh.load(Path(sys.argv[2]))
STIFF = Problem(MESH, Material(law="neo-hookean"), Load(displacement=(0.0, -2.0)))


def numbers(solution: Solution) -> list[object]:
    return [solution.energy, solution.displacement(MESH.markers).tolist()]


def sharing(problem, progress) -> int:
    return communicator().size


def fail(rank: int, problem, progress) -> None:
    if rank == RANK:
        raise UserError(f"no memory is left on rank {rank}")
    communicator().Barrier()


def solve() -> int:
    """Only rank 0 gets here; the exit code is its own."""
    solvers = [make_solver(name) for name in ("fem", "fem-nonlinear")]
    report = {
        "solutions": [
            numbers(solver.solve(problem))
            for solver, problem in zip(solvers, (Problem(MESH), STIFF), strict=True)
        ],
        "sharing": [communicator().size, on_all_ranks(sharing, Problem(MESH), print), communicator().size],
        "launcher": [name for name in os.environ if name.startswith("OMPI_COMM")],
    }
    print(json.dumps(report))
    return 3


def everywhere() -> None:
    """Every rank runs the whole program."""
    report = {
        "solutions": [numbers(make_solver("fem").solve(Problem(MESH)))],
        "sharing": [communicator().size],
    }
    if RANK == 0:
        print(json.dumps(report))


def solid() -> int:
    """`fem-3d` on all ranks."""
    print(json.dumps({"solutions": [numbers(make_solver("fem-3d", layers=1).solve(STIFF))]}))
    return 0


def refused() -> int:
    make_solver("fem").solve(STIFF)
    return 0


failing_on_rank_0, failing_on_rank_1 = (
    partial(on_all_ranks, partial(fail, rank), STIFF, print) for rank in (0, 1)
)


def faulty() -> int:
    raise RuntimeError("a fault of the program")


def waiting() -> int:
    print("waiting", flush=True)
    time.sleep(60)
    return 0


def guarded(command) -> int:
    try:
        return command()
    except UserError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130


if __name__ == "__main__":
    program = globals()[sys.argv[1]]
    sys.exit(program() if program is everywhere else lead(program, guarded))
