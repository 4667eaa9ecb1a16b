"""Strips of spring steel, 0.2 mm thick, under a cylinder."""

import numpy as np
import pytest

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.drawing.description import Description
from pinnray.geometry.drawing.load import finger_from_file
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.solvers.fem.finite_strain import load_path
from pinnray.solvers.fem.finite_strain.nested_path import coarser
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.problem import Load, Material, Problem
from tests.geometry.drawing.files import rectangle, write_dxf

STEEL = Material(young=2e5, poisson=0.3, law="neo-hookean")


@pytest.fixture(scope="module")
def strip(tmp_path_factory):
    """A strip of 60 mm, clamped at the left end, touched at x = 40 mm."""
    file = write_dxf(tmp_path_factory.mktemp("strip") / "strip.dxf", [rectangle(0, -0.2, 60, 0.2)])
    where = Description(clamp=(((0, 0), (0, -0.2)),), contact=(40, 0), contact_width=1, markers=((50, -0.1),))
    return finger_from_file(file, where)


def test_a_thin_strip_has_coarser_elements_to_start_on(strip):
    problem = Problem(finger_mesh(strip, settings=MeshSettings(size=0.25)), STEEL, finger=strip)
    coarse = coarser(problem)
    assert coarse is not None
    assert 4 * len(coarse.mesh.triangles) < len(problem.mesh.triangles)


@pytest.mark.slow
def test_a_cylinder_bends_a_strip_of_steel(strip):
    mesh = finger_mesh(strip, settings=MeshSettings(size=1.0), across=1)
    problem = Problem(mesh, STEEL, Load("cylinder", stroke=15.0), finger=strip)
    bent = FemNonlinearSolver().solve(problem)
    assert bent.status.converged
    assert bent.stats["load_steps"] <= 12
    assert bent.stats["penetration_mm"] < 1e-5


@pytest.mark.slow
def test_a_contact_that_is_hardened_in_a_step_ends_as_the_hard_one(coarse_mesh, monkeypatch):
    problem = Problem(coarse_mesh, Material(law="neo-hookean"), Load("cylinder", stroke=3.0))
    hard = FemNonlinearSolver().solve(problem)
    monkeypatch.setattr(load_path, "SLENDER", 0.0)
    hardened = FemNonlinearSolver().solve(problem)
    assert hardened.stats["newton_iterations"] != hard.stats["newton_iterations"]
    moved = [each.displacement(coarse_mesh.points) for each in (hard, hardened)]
    np.testing.assert_allclose(*moved, atol=2e-5)
    assert hardened.energy == pytest.approx(hard.energy, rel=1e-5)
