"""One of several processes that train a small network and write its parameters, for the test to compare."""

import os
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from pinnray.solvers.problem import Problem
from pinnray.solvers.solver import TrainingContext
from tests.solvers.conftest import bar_mesh
from tests.solvers.pinn.test_pinn_training import SMALL


def main(folder: Path) -> None:
    """Train, and write the parameters and how often progress was told."""
    rank = os.environ["RANK"]
    solver = replace(SMALL, precision="double", epochs=15).in_context(TrainingContext(folder))
    told: list[str] = []
    problem = Problem(bar_mesh(24.0, 4.0, 12, 4, contact=(14.0, 18.0)))
    solution = solver.solve(problem, lambda _, text: told.append(text))
    np.save(folder / f"rank{rank}.npy", solution.field.parameters.numpy())  # type: ignore[attr-defined]
    (folder / f"told{rank}").write_text(str(len(told)))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
