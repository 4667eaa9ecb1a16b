"""The true force of a film: every frame is an equilibrium."""

import csv

import numpy as np
import pytest

from pinnray.cli import main
from pinnray.comparison.evaluation.virtual_experiment import simulate
from pinnray.film.filmed_force import LONGEST_STEP, filmed_course, true_forces
from pinnray.geometry.finger.design import Design
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.vision.rig.bench import Bench
from pinnray.vision.rig.motion import Motion
from pinnray.vision.rig.recording import Recording
from pinnray.vision.rig.virtual_camera import default_camera, viewing_pose
from pinnray.vision.tracking.workspace import default_workspace

pytestmark = pytest.mark.usefixtures("few_elements_throughout")


def filmed(finger, solution):
    mesh, workspace, camera = solution.problem.mesh, default_workspace(finger), default_camera(320, 180)
    return Recording(
        bench=Bench(mesh, finger, workspace),
        displacement=solution.displacement(mesh.at_nodes()),
        camera=camera,
        pose=viewing_pose(camera, workspace),
        motion=Motion(rest=2, moving=6, held=2, shutter=0.0),
        course=filmed_course(solution),
    )


@pytest.fixture(scope="module")
def finger():
    return Design()


def test_a_frame_on_the_way_is_an_equilibrium_with_the_force_that_is_written(coarse_mesh, finger):
    problem = Problem(coarse_mesh, load=Load(displacement=(0.0, -8.0)))
    solution = simulate(problem, degree=1, max_step=LONGEST_STEP)
    recording = filmed(finger, solution)
    row = true_forces(solution, recording, 25.0)[4]
    share = row["load"]
    assert 0.3 < share < 0.7
    assert share not in solution.history["load_fraction"]
    load = Load(kind="patch", displacement=(None, -8.0 * share))
    there = FemNonlinearSolver(degree=1).solve(Problem(coarse_mesh, Material(law="neo-hookean"), load))
    exact = there.displacement(coarse_mesh.at_nodes())
    np.testing.assert_allclose(recording.displaced(share), exact, atol=0.002)  # of 8 mm, as in `LONGEST_STEP`
    assert row["force_N"] == pytest.approx(-25.0 * there.reaction[1], rel=1e-4)
    assert row["tangential_force_N"] == pytest.approx(25.0 * there.reaction[0], abs=1e-9)
    assert row["position_mm"] == pytest.approx(there.stats["force_abscissa_mm"], abs=0.01)


def test_a_linear_solver_goes_straight(coarse_mesh, finger):
    solution = FemSolver(degree=1, estimate=False).solve(Problem(coarse_mesh))
    recording = filmed(finger, solution)
    rows = true_forces(solution, recording, 25.0)
    np.testing.assert_allclose(recording.displaced(0.5), 0.5 * recording.displacement, atol=1e-12)
    forces = np.array([row["force_N"] for row in rows])
    np.testing.assert_allclose(forces, [row["load"] * forces[-1] for row in rows], atol=1e-12)
    assert rows[0]["position_mm"] == ""


@pytest.mark.slow
def test_the_rig_writes_the_force_beside_the_film(tmp_path):
    options = "--mesh-size 1 --size 480x270 --rest 2 --moving 2 --held 2"
    assert main(["rig", *options.split(), "--out", str(tmp_path / "film")]) == 0
    with (tmp_path / "film" / "truth_force.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 6
    forces = [float(row["force_N"]) for row in rows]
    assert forces[0] == 0 < forces[2] < forces[3] < forces[4] == forces[5]
    assert float(rows[5]["position_mm"]) == pytest.approx(33.6, abs=0.2)  # 1.4 mm from the patch's middle
