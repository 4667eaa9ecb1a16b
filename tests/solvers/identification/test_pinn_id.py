"""`pinn-id` against its twin in finite elements, and its refits of first order."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.fem.identification import FemIdSolver
from pinnray.solvers.identification import search
from pinnray.solvers.identification.law_fits import LawFits
from pinnray.solvers.identification.model import ResponseModel
from pinnray.solvers.pinn.identification.network_body import NetworkBody
from pinnray.solvers.pinn.identification.solver import PinnIdSolver
from pinnray.solvers.problem import Load, Material, Problem
from tests.solvers.conftest import SHORT, distances, observed_at

NOISE = 0.01
SETTINGS = {"spacing": 1.0}


@pytest.fixture(scope="module")
def problem():
    """A short finger with one rib, and its markers under a sliding patch, with noise."""
    mesh = finger_mesh(SHORT, settings=MeshSettings(size=0.5))
    material = Material(law="neo-hookean")
    truth = FemNonlinearSolver().solve(Problem(mesh, material, Load(kind="patch", displacement=(None, -4.0))))
    moved = truth.displacement(mesh.markers)
    moved = moved + NOISE * np.random.default_rng(2).normal(size=moved.shape)
    observed = observed_at(mesh.markers, moved, NOISE)
    return Problem(mesh, material, Load(displacement=(None, -4.0)), observed)


@pytest.fixture(scope="module")
def refit(problem):
    return PinnIdSolver(**SETTINGS).refitter(replace(problem, observations=None))


@pytest.fixture(scope="module")
def found(refit, problem):
    return refit(problem.observations)


@pytest.mark.slow
def test_it_is_near_its_twin(problem, found):
    """Within 0.3 % in displacement, 10 % in stress; the force within a tenth of its own interval.

    Measured: 0.16 %, 7 % and a twentieth. Elements of 0.5 mm leave finite elements some 4 % from
    converged stress at the corners.
    """
    twin = FemIdSolver().solve(problem)
    displacement, stress = distances(found, twin)
    assert displacement < 0.003
    assert stress < 0.1
    assert found.stats["law"] == twin.stats["law"]
    width = twin.stats["force_high"] - twin.stats["force_low"]
    assert abs(found.stats["force"] - twin.stats["force"]) < 0.1 * width
    assert found.status.converged


@pytest.mark.slow
def test_where_the_network_finds_no_equilibrium_the_status_says_so(problem, monkeypatch):
    """A law that gives way in compression may have none with windows as fine as those at corners."""
    known = ResponseModel.response

    def by_elements(self, *arguments, **options):
        return None if isinstance(self.body, NetworkBody) else known(self, *arguments, **options)

    monkeypatch.setattr(ResponseModel, "response", by_elements)
    solver = PinnIdSolver(spacing=3.0, law="given", parameters="position,normal_force")
    found = solver.solve(problem)
    assert not found.status.converged


@pytest.mark.release
def test_where_first_order_does_not_settle_the_network_seeks_the_unknowns(problem, found, monkeypatch):
    asked, fit = [], LawFits.fit

    def counted(self, law, measurement, near, *rest, **options):
        asked.append(type(self.model(law).body))
        return fit(self, law, measurement, near, *rest, **options)

    monkeypatch.setattr(search, "POLISHES", 0)
    monkeypatch.setattr(LawFits, "fit", counted)
    sought = PinnIdSolver(**SETTINGS).solve(problem)
    assert asked[-1] is NetworkBody
    assert sought.status.converged
    width = found.stats["force_high"] - found.stats["force_low"]
    assert abs(sought.stats["force"] - found.stats["force"]) < 0.02 * width


@pytest.mark.release
def test_a_refit_of_first_order_is_a_fit_for_what_a_marker_left_out_changes(problem, found, refit):
    """The prediction of the marker by the others, to half of the noise."""
    observed = problem.observations
    visible = np.arange(len(observed.points)) != 1
    without = replace(observed, visible=visible)
    quick = refit(without)
    whole = PinnIdSolver(**SETTINGS).solve(replace(problem, observations=without))
    marker = problem.mesh.markers[[1]]
    predicted = [each.displacement_in_space(marker)[0] for each in (quick, whole)]
    np.testing.assert_allclose(predicted[0], predicted[1], atol=0.5 * NOISE)
    np.testing.assert_allclose(found.left_out[1], predicted[1], atol=0.5 * NOISE)
    assert quick.stats["seconds"] < 0.2 * whole.stats["seconds"]
