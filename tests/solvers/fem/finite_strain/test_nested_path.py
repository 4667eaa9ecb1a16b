"""A load path on coarse elements whose end is carried to fine ones."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.solvers.fem.finite_strain import solver
from pinnray.solvers.fem.finite_strain.nested_path import ACROSS, coarser
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.problem import Load, Material, Problem
from tests.solvers.conftest import SHORT

FINE = Problem(
    finger_mesh(SHORT, settings=MeshSettings(size=0.45)),
    Material(law="neo-hookean"),
    Load(displacement=(0.0, -5.0)),
    finger=SHORT,
)
SOLVER = FemNonlinearSolver(first_step=0.2)
TOUCHED = {
    "patch": Load(kind="patch", displacement=(None, -3.0)),
    "cylinder": Load(kind="cylinder", radius=5.0, displacement=(0.0, -2.0)),
}


def plainly(problem):
    """The solution by the path on the given elements alone."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(solver, "coarser", lambda *_: None)
        return SOLVER.solve(problem)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["mean", *(pytest.param(kind, marks=pytest.mark.slow) for kind in TOUCHED)])
def test_the_end_is_the_equilibrium_of_the_path_on_fine_elements(kind):
    """Newton's tolerance leaves 1e-8 mm, the settling of a contact 1e-5 mm of penetration."""
    problem = replace(FINE, load=TOUCHED.get(kind, FINE.load))
    nested = SOLVER.solve(problem)
    assert "on elements of 1 mm" in nested.status.message
    plain = plainly(problem)
    assert "on elements of" not in plain.status.message
    nodes = problem.mesh.points
    away = np.abs(nested.displacement(nodes) - plain.displacement(nodes)).max()
    assert away < (5e-5 if kind == "cylinder" else 1e-6)
    assert nested.energy == pytest.approx(plain.energy, rel=1e-5 if kind == "cylinder" else 1e-9)
    off = (1e-4 if kind == "cylinder" else 1e-5) * np.abs(plain.reaction).max()
    np.testing.assert_allclose(nested.reaction, plain.reaction, atol=off)
    # Elements of 1 mm are up to 1 % off on the way.
    for column in ("energy", "reaction_y"):
        histories = [each.history for each in (nested, plain)]
        ways = [np.interp([0.3, 0.6, 0.9], each["load_fraction"], each[column]) for each in histories]
        np.testing.assert_allclose(*ways, atol=0.02 * np.abs(plain.history[column]).max())
    assert len(nested.states) == len(nested.history["load_fraction"])
    half = nested.states[-2].displacement(problem.mesh.locate(problem.mesh.markers))
    assert np.isfinite(half).all()


@pytest.mark.slow
def test_where_coarse_elements_lead_elsewhere_the_path_is_followed_on_the_fine_ones(monkeypatch):
    """The guess is spoilt: the equilibrium found from it is far from it."""
    followed = solver.LoadPath.interpolated  # type: ignore[attr-defined]

    def elsewhere(path, way, nodal):
        return 1.2 * followed(path, way, nodal)

    monkeypatch.setattr(solver.LoadPath, "interpolated", elsewhere)  # type: ignore[attr-defined]
    found = SOLVER.solve(FINE)
    assert found.status.converged
    assert "on elements of" not in found.status.message


@pytest.mark.slow
def test_friction_is_followed_on_the_given_elements():
    load = Load(kind="cylinder", radius=5.0, displacement=(0.0, -1.0), friction=0.3)
    found = SOLVER.solve(replace(FINE, load=load))
    assert found.status.converged
    assert "on elements of" not in found.status.message


def test_a_mesh_that_is_coarse_or_of_another_body_has_no_coarser_one():
    assert coarser(FINE) is not None
    assert coarser(replace(FINE, finger=None)) is None
    assert coarser(replace(FINE, finger=SHORT.replaced(front_thickness=3.0))) is None
    coarse = finger_mesh(SHORT, settings=MeshSettings(size=0.8), across=ACROSS)
    assert coarser(replace(FINE, mesh=coarse)) is None
