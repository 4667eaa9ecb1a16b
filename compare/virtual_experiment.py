"""Marker displacements from a finite-strain simulation, where no camera has measured any.

The indenter is a sliding patch on a neo-Hookean finger: a model that is richer than the linear ones that are judged by it, and
whose distance from them is known to be of the size and pattern of the paper's gap between simulation and experiment.
"""

import hashlib
import json
import os
from pathlib import Path

import numpy as np

from compare.atomic import atomic_path
from geometry.cache import cache_folder
from geometry.errors import UserError
from geometry.observations import Observations
from solvers.fem.nonlinear import FemNonlinearSolver
from solvers.problem import Problem
from solvers.solver import Progress, silent
from vision.measurements import read_measurements, write_measurements


def virtual_experiment(problem: Problem, progress: Progress = silent) -> Observations:
    """Simulate what a camera would have measured at the mesh's markers; kept in the cache folder.

    Raises:
        UserError: If the simulation does not reach the full load.
    """
    solver = FemNonlinearSolver()
    richer = Problem(
        mesh=problem.mesh,
        material=problem.material.model_copy(update={"law": "neo-hookean", "plane": "strain"}),
        load=problem.load.model_copy(
            update={"kind": "patch", "displacement": (None, problem.load.displacement[1])}
        ),
    )
    if richer.load.displacement[1] is None:
        raise UserError(
            "the virtual experiment presses on the finger: prescribe v, or give --measurements FILE.csv"
        )
    entry = cache_folder() / f"experiment-{_key(solver, richer)}.csv"
    if entry.exists():
        progress(1.0, "from the cache")
        return read_measurements(entry)
    solution = solver.solve(richer, progress)
    if not solution.status.converged:
        raise UserError(f"the virtual experiment {solution.status.message}; or give --measurements FILE.csv")
    markers = problem.mesh.markers
    observations = Observations(
        points=markers,
        displacements=solution.displacement(markers),
        standard_deviations=np.zeros_like(markers),
        visible=np.ones(len(markers), dtype=bool),
        source="simulated by fem-nonlinear (neo-Hookean, finite strain, sliding contact patch); no camera was involved",
        simulated=True,
    )
    with atomic_path(entry) as partial:
        write_measurements(partial, observations)
    return observations


def _key(solver: FemNonlinearSolver, problem: Problem) -> str:
    sources = sorted(
        source
        for folder in ("solvers", "solvers/fem")
        for source in (Path(__file__).parent.parent / folder).glob("*.py")
    )
    sha = hashlib.sha256(problem.digest.encode())
    sha.update(json.dumps(solver.settings(), sort_keys=True).encode())
    for source in sources:
        sha.update(os.fsencode(source.name))
        sha.update(source.read_bytes())
    return sha.hexdigest()
