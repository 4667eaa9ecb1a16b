"""A finger of a million triangles on one and on two MPI ranks, factorised and iterated: time and memory.

Takes several minutes and 8 GB of memory. The mesh is cached; the title has the time to make or read it.
"""

import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from itertools import product
from pathlib import Path

import numpy as np
from rich.table import Table

from compare.runtime.tables import terminal_table
from geometry.cache import finger_mesh
from geometry.finger.design import Design
from geometry.mesh.settings import MeshSettings
from geometry.mesh.triangle_mesh import TriangleMesh
from geometry.worker import child_environment
from solvers.fem.linear import FemSolver
from solvers.problem import Problem

SIZE_MM = 0.0325
PATIENCE_S = 3600.0


def main() -> Table:
    """Solve each case in its own process, so that its memory can be measured."""
    started = time.perf_counter()
    mesh = finger_mesh(Design(), settings=MeshSettings(size=SIZE_MM), timeout_s=PATIENCE_S)
    seconds = time.perf_counter() - started
    first: dict[int, list[list[float]]] = {}
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mesh.npz"
        mesh.save(path)
        for degree, linear_solver, ranks in product((1, 2), ("direct", "iterative"), (1, 2)):
            found = _on_ranks(ranks, path, degree, linear_solver)
            markers = found["markers"]
            away = np.abs(np.subtract(markers, first.setdefault(degree, markers))).max()
            times = (f"{found[name]:.1f}" for name in ("reading", "seconds"))
            memory = (f"{size:.2f}" for size in (found["memory"][0], sum(found["memory"])))
            rows.append(
                (
                    *(str(degree), f"{found['unknowns']:,}", linear_solver, str(ranks), *times),
                    *(str(found["iterations"] or "-"), *memory, f"{away:.0e}"),
                )
            )
    header = (
        *("degree", "unknowns", "linear solver", "ranks", "reading, s", "solve, s", "iterations"),
        *("memory of rank 0, GB", "of all, GB", "markers differ by, mm"),
    )
    title = f"{len(mesh.triangles):,} triangles (mesh made or read in {seconds:.0f} s)"
    return terminal_table(title, header, rows)


def _on_ranks(ranks: int, path: Path, degree: int, linear_solver: str) -> dict:
    launcher = shutil.which("mpirun") or "mpirun"
    arguments = [
        sys.executable,
        "-m",
        "benchmarks.elements.million_triangles",
        str(path),
        str(degree),
        linear_solver,
    ]
    done = subprocess.run(
        [launcher, "--allow-run-as-root", "--oversubscribe", "-n", str(ranks), *arguments],
        stdout=subprocess.PIPE,
        text=True,
        check=True,
        env={**child_environment(os.environ), "OMP_NUM_THREADS": "1"},
    )
    return json.loads(done.stdout)


def _solve(path: str, degree: str, linear_solver: str) -> None:
    """Solve on every rank; the first prints the result as JSON."""
    from mpi4py import MPI

    started = time.perf_counter()
    problem = Problem(TriangleMesh.load(Path(path)))
    reading = time.perf_counter() - started
    solution = FemSolver(int(degree), estimate=False, linear_solver=linear_solver).solve(problem)
    memory = MPI.COMM_WORLD.gather(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20)
    if MPI.COMM_WORLD.rank == 0:
        report = {
            "reading": reading,
            "seconds": solution.stats["seconds"],
            "unknowns": solution.stats["unknowns"],
            "iterations": solution.stats.get("iterations", 0),
            "memory": memory,
            "markers": solution.field.values[problem.mesh.marker_nodes].tolist(),
        }
        print(json.dumps(report))


if __name__ == "__main__":
    _solve(*sys.argv[1:])
