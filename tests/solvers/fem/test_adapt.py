"""Refinement to a tolerance at the markers, against graded meshes and against uniform ones."""

import numpy as np
import pytest

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.section import finger_section
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.solvers.fem.adaptive_refinement import adapted, largest
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Problem


@pytest.fixture(scope="module")
def adaptation(coarse_mesh):
    return adapted(Problem(coarse_mesh), 1e-3)


@pytest.fixture(scope="module")
def exact(coarse_mesh):
    """Displacements of the markers, known to about 0.0001 mm by a graded mesh."""
    graded = finger_mesh(Design(), settings=MeshSettings(size=0.4, corner_size=0.005, contact_size=0.1))
    return FemSolver(estimate=False).solve(Problem(graded)).displacement(coarse_mesh.markers)


def off(mesh, exact):
    """Largest true error of u or v at a marker, mm, and the unknowns."""
    solution = FemSolver(estimate=False).solve(Problem(mesh))
    return np.abs(solution.displacement(mesh.markers) - exact).max(), solution.stats["unknowns"]


@pytest.mark.slow
def test_the_tolerance_is_reached_and_true(adaptation, exact):
    """The estimate, and the true error within the factor of two that estimates have."""
    assert adaptation.reached
    last = adaptation.rounds[-1].at_markers
    assert last <= 1e-3
    assert off(adaptation.mesh, exact)[0] < 2e-3


@pytest.mark.slow
def test_it_beats_uniform_refinement(adaptation, medium_mesh, exact):
    """With about the unknowns of uniform 0.5 mm elements (24 and 21 thousand) a fifth of the error."""
    fine, count = off(adaptation.mesh, exact)
    uniform, many = off(medium_mesh, exact)
    assert count < 1.2 * many
    assert fine < 0.2 * uniform


def test_rounds_are_recorded_from_the_first_mesh_on(adaptation, coarse_mesh):
    first, last = adaptation.rounds[0], adaptation.rounds[-1]
    assert (first.triangles, first.nodes) == (len(coarse_mesh.triangles), len(coarse_mesh.points))
    assert (last.triangles, last.nodes) == (len(adaptation.mesh.triangles), len(adaptation.mesh.points))
    counts = [step.triangles for step in adaptation.rounds]
    assert counts == sorted(counts)
    assert adapted(Problem(coarse_mesh), 1e-3).mesh.digest == adaptation.mesh.digest, "it repeats"


def test_a_mesh_that_is_fine_enough_stays_as_it_is(medium_mesh):
    adaptation = adapted(Problem(medium_mesh), 0.1)
    assert adaptation.mesh is medium_mesh
    assert len(adaptation.rounds) == 1


@pytest.mark.parametrize("cap", [{"most_triangles": 4500}, {"most_rounds": 3}])
def test_a_cap_ends_it_and_it_says_so(coarse_mesh, cap):
    adaptation = adapted(Problem(coarse_mesh), 1e-6, **cap)
    assert not adaptation.reached
    assert len(adaptation.mesh.triangles) <= 4500


@pytest.mark.slow
def test_fillets_get_rounder():
    """The polygon that a fillet's arc is meshed as has too much area; refined with the section, less."""
    design = Design(fillet_radius=1.0)
    mesh, section = finger_mesh(design, settings=MeshSettings(size=1.0)), finger_section(design)
    adaptation = adapted(Problem(mesh), 3e-4, section=section)
    assert adaptation.reached
    assert section.area < adaptation.mesh.areas.sum() < mesh.areas.sum() - 1e-3


def test_the_fewest_triangles_hold_the_share():
    """Half of 10: the two largest, whatever their sign."""
    assert largest(np.array([1.0, -4.0, 2.0, 3.0]), 0.6).tolist() == [False, True, False, True]
    assert largest(np.array([1.0, -4.0, 2.0, 3.0]), 0.3).tolist() == [False, True, False, False]
