"""Numbers of every solver on one stored mesh, for other machines and versions to be compared with.

`python -m tests.solvers.contract.golden` prints them as they stand in `tests/data/golden.json`. The
mesh, of the default finger with elements of 1.5 mm, is stored too, because every version of Gmsh makes
another one.
"""

import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.observations import Observations
from pinnray.runtime.machine import package_versions
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solver import Traits, with_law

DATA = Path(__file__).parents[2] / "data"
NUMBERS, MESH = DATA / "golden.json", DATA / "golden-mesh.npz"

DISPLACEMENTS = np.array(
    [
        *[(-0.689, -4.699), (0.674, -4.0), (-1.387, -9.115), (1.228, -7.721), (-1.489, -9.116)],
        *[(1.188, -7.761), (-1.786, -6.256), (0.068, -5.322), (-2.305, -0.628)],
    ]
)
"""Of the nine markers of the default finger, simulated and rounded, mm."""

CYLINDER = Load(kind="cylinder", radius=10.0)
JOBS: dict[str, tuple[dict[str, Any], Material, Load]] = {
    "fem": ({}, Material(), Load()),
    "fem degree-1": ({"degree": 1}, Material(), Load()),
    "fem plane-stress": ({}, Material(plane="stress"), Load()),
    "fem-nonlinear": ({}, Material(), Load()),
    "fem-nonlinear cylinder": ({}, Material(), CYLINDER),
    "fem-asm": ({}, Material(), Load()),
    "fem-id": ({}, Material(), Load()),
    "gp": ({}, Material(), Load()),
    "pinn-std": ({}, Material(), Load()),
    "pinn-asm": ({}, Material(), Load()),
    "pinn-std local": ({"preset": "local"}, Material(), Load()),
}
"""Settings of a solver, material and load; a name begins with that of its solver."""


def golden(name: str) -> dict[str, float]:
    """The numbers of a job: N mm/mm, N/mm, mm and MPa."""
    settings, material, load = JOBS[name]
    solver, mesh = make_solver(name.partition(" ")[0], **settings), TriangleMesh.load(MESH)
    problem = Problem(mesh, with_law(material, solver), load, finger=Design())
    if Traits.of(solver).assimilates:
        exact, all_seen = np.zeros_like(DISPLACEMENTS), np.full(len(DISPLACEMENTS), True)
        measured = Observations(mesh.markers, DISPLACEMENTS, exact, all_seen, "stored", True, 0.8)
        problem = replace(problem, observations=measured)
    solution = solver.solve(problem)
    evaluation = Evaluation.of(solution, mesh)
    (middle_u, middle_v), (tip_u, tip_v) = evaluation.marker_displacement[[4, -1]]
    return {
        "energy": evaluation.energy,
        "reaction x": float(evaluation.reaction[0]),
        "reaction y": float(evaluation.reaction[1]),
        "u of marker 5": float(middle_u),
        "v of marker 5": float(middle_v),
        "u of marker 9": float(tip_u),
        "v of marker 9": float(tip_v),
        "mean von Mises stress": float(np.average(evaluation.von_mises, weights=evaluation.weights)),
    }


def main() -> None:
    """Print the numbers of all jobs, and the system that they are of."""
    jobs = {name: golden(name) for name in JOBS}
    known = package_versions()
    system = {
        name: known[name] for name in ("python", "fenics-dolfinx", "petsc4py", "numpy", "scipy", "torch")
    }
    system["threads"] = os.environ.get("OMP_NUM_THREADS", "all")
    print(json.dumps({"system": system, "jobs": jobs}, indent=1))


if __name__ == "__main__":
    main()
