"""Objects of PETSc: petsc4py keeps what is not destroyed for ever, so that every solve would take memory."""

import os
import re
import subprocess
import sys

import pytest

from pinnray.runtime.processes.pool import child_environment

PROGRAM = """
import numpy as np
from pinnray.geometry import Design, MeshSettings, Observations, finger_mesh
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.registry import make_solver

design = Design(height=50, rib_count=1, tip_length=12, contact_position=20)
mesh = finger_mesh(design, settings=MeshSettings(size=1.5), across=1)
markers = mesh.markers
deviations, seen = np.full_like(markers, 0.01), np.ones(len(markers), bool)
observations = Observations(markers, -0.01 * markers, deviations, seen, "test", True, 0.8)
for name, law, kind in [
    ("fem", "linear", "mean"),  # with its error estimate
    ("fem-nonlinear", "neo-hookean", "mean"),
    ("fem-nonlinear", "neo-hookean", "cylinder"),
    ("fem-asm", "linear", "mean"),
    ("fem-asm", "neo-hookean", "mean"),
    ("fem-3d", "linear", "mean"),
]:
    load = Load(kind=kind, displacement=(0.0, -1.0), radius=5.0 if kind == "cylinder" else None)
    given = observations if "asm" in name else None
    problem = Problem(mesh, Material(law=law), load, given, design)
    make_solver(name, **({"layers": 1} if name == "fem-3d" else {})).solve(problem)
"""


@pytest.mark.slow
def test_every_object_of_petsc_is_destroyed():
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        env=child_environment(os.environ) | {"PETSC_OPTIONS": "-log_view"},
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    table = done.stdout.partition("Object Type")[2].partition("===")[0]
    counts = re.findall(r"^ *(.+?) +(\d+) +(\d+)$", table, re.M)
    assert int({kind: made for kind, made, _ in counts}["Vector"]) > 0
    assert [row for row in counts if row[1] != row[2] and row[0] != "Viewer"] == []
