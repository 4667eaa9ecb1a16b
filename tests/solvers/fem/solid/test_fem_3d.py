"""`fem-3d` against closed forms, plane strain, plane stress and its own energy."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.comparison.evaluation.certifier import with_certificates
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.solvers.extrusion import ExtrudedSpace
from pinnray.solvers.fem.equilibrium import DiscreteEquilibrium
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.fem.solid import FaceField, Fem3dSolver
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.solution import State
from pinnray.studies.crossval.true_fields import FieldSampler
from tests.solvers.bodies import body_mesh
from tests.solvers.conftest import bar_mesh

SLIDING = Load(kind="patch", displacement=(None, -4.0))


@pytest.fixture(scope="module")
def wedge():
    """A wedge with two cavities whose base leans, 6 mm deep, of elements of 1.5 mm."""
    return replace(body_mesh("tilted wedge", 1.5), depth=6.0)


def test_the_tetrahedra_fill_the_half_body(wedge):
    space = ExtrudedSpace.of(wedge, 3, 0.25)
    corners = space.nodes[space.vertices][space.cells]
    volumes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6
    assert volumes.min() > 0
    assert volumes.sum() == pytest.approx(3.0 * wedge.areas.sum(), rel=1e-12)
    thickness = np.diff(space.faces)
    assert thickness[-1] / thickness[0] == pytest.approx(0.25)


def test_neighbouring_tetrahedra_share_whole_faces(wedge):
    """Every face belongs to two tetrahedra, or lies on the outline or on one of the two end planes."""
    space = ExtrudedSpace.of(wedge, 2, 0.5)
    sides = np.sort(space.cells[:, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]].reshape(-1, 3), axis=1)
    _, counts = np.unique(sides, axis=0, return_counts=True)
    rim = len(wedge.edges) * 2 - 3 * len(wedge.triangles)  # edges with one triangle
    assert counts.max() == 2
    assert (counts == 1).sum() == 2 * len(wedge.triangles) + 2 * 2 * rim


def bent(nodes: np.ndarray, curvature: float, ν: float) -> np.ndarray:
    """Displacement of a bar under end couples: Timoshenko, Goodier, Theory of Elasticity, article 102."""
    x, y, z = nodes.T
    across = -0.5 * curvature * (x**2 + ν * (y**2 - z**2))
    return np.column_stack([curvature * x * y, across, -ν * curvature * y * z])


def test_pure_bending_is_exact():
    """Its displacement is quadratic, so that forces act on the two ends alone, and strain turns with y."""
    mesh, curvature = replace(bar_mesh(10, 2, 10, 3, contact=(8, 10)), depth=3.0), 0.01
    material = Material()
    space = ExtrudedSpace.of(mesh, 2, 0.5)
    equilibrium = DiscreteEquilibrium(Problem(mesh, material), space)
    nodal = bent(space.nodes, curvature, material.poisson)
    force = equilibrium.internal_force(nodal)
    inside = (space.nodes[:, 0] > 0) & (space.nodes[:, 0] < 10)
    assert np.abs(force[inside & ~space.mirrored.any(axis=1)]).max() < 1e-11 * np.abs(force).max()
    # E κ² / 2 times the integral of y² over 10 mm by 0 to -2 mm
    assert equilibrium.energy(nodal) == pytest.approx(0.5 * 11.4 * curvature**2 * 10 * 8 / 3, rel=1e-12)
    equilibrium.factors.destroy()
    location = mesh.at_centroids()
    gradient = FaceField(space, nodal).solid_gradient(location)
    state = State.from_gradient(gradient, Problem(mesh, material))
    expected = 11.4 * curvature * location.points[:, 1]
    np.testing.assert_allclose(state.stress[:, 0, 0], expected, atol=1e-12)
    np.testing.assert_allclose(state.von_mises, np.abs(expected), atol=1e-12)


@pytest.mark.parametrize("law", ["linear", pytest.param("neo-hookean", marks=pytest.mark.slow)])
def test_held_side_faces_make_plane_strain(wedge, law):
    problem = Problem(wedge, Material(law=law), SLIDING)
    solid = Fem3dSolver(sides="held", layers=2).solve(problem)
    plane = (FemSolver(estimate=False) if law == "linear" else FemNonlinearSolver()).solve(problem)
    assert solid.status.converged
    # More unknowns than in the plane, so less energy, by the error of elements of 1 mm.
    assert 0.995 < solid.energy / plane.energy < 1
    gap = solid.displacement(wedge.markers) - plane.displacement(wedge.markers)
    assert np.abs(gap).max() < 0.005


def test_a_thin_finger_is_in_plane_stress(wedge):
    problem = Problem(replace(wedge, depth=0.2), Material(), Load(kind="patch", displacement=(0.0, -2.0)))
    solid = Fem3dSolver(layers=1).solve(problem)
    plane = FemSolver(estimate=False).solve(replace(problem, material=Material(plane="stress")))
    strain = FemSolver(estimate=False).solve(problem)
    assert solid.energy == pytest.approx(plane.energy, rel=0.01)  # the rest is at corners, clamp and patch
    assert strain.energy > 1.2 * plane.energy
    location = wedge.at_centroids()
    ours, theirs = (each.state(location).von_mises for each in (solid, plane))
    assert np.linalg.norm(ours - theirs) < 0.05 * np.linalg.norm(theirs)


def test_plane_strain_does_not_certify_it(wedge):
    problem = Problem(wedge, load=Load(displacement=(0.0, -2.0)))
    evaluation = Evaluation.of(Fem3dSolver(layers=1).solve(problem), wedge)
    (judged,) = with_certificates([evaluation], problem)
    assert judged.converged
    assert judged.certificate is None


def test_cross_validation_does_not_read_its_stress_as_that_of_the_plane(wedge):
    solution = Fem3dSolver(layers=1).solve(Problem(wedge, load=SLIDING))
    sampler = FieldSampler.of(wedge, wedge.markers, 0.4)
    sampled = sampler.of_solution(solution, wedge)
    expected = solution.state(sampler.inside).von_mises
    np.testing.assert_array_equal(sampled.state(solution.problem).von_mises, expected)
    plane = State.from_gradient(sampled.gradient[:, :2, :2], solution.problem).von_mises
    assert np.abs(plane - expected).max() > 0.01 * expected.max()
