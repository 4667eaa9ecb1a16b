"""The search: laws that get lost, doubtful and hidden markers, several starts."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.boundary import mean_thickness
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.solvers.fem.finite_strain import nested_path
from pinnray.solvers.fem.identification import FemBody, FemIdSolver
from pinnray.solvers.identification.law_fits import MOST_LOST, LawFits
from pinnray.solvers.identification.model import ResponseModel
from pinnray.solvers.identification.result import Identified
from pinnray.solvers.identification.search import STARTS, Identifier
from pinnray.solvers.identification.unknowns import LAW_ODDS, LAWS
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.solver import NoSolutionError
from tests.solvers.conftest import observed_at
from tests.solvers.identification.twins import NOISE, TRUE, sought, twin


def test_the_force_is_the_mean_over_the_laws_by_their_odds(identified):
    """Made equally likely by the markers, the laws keep the odds that they had before."""
    observed, _, solution = identified
    problem = replace(solution.problem, observations=None)
    identifier = Identifier(FemIdSolver(degree=1), problem, lambda unknowns: FemBody(unknowns, 1))
    found = identifier.identify(observed)
    by_law = {fit.law: fit for fit in found.fits}
    logs = [by_law[law].log_evidence + np.log(odds) for law, odds in LAW_ODDS.items()]
    share = dict(zip(LAW_ODDS, np.exp(logs - np.logaddexp(*logs)), strict=True))
    np.testing.assert_allclose(found.probabilities, [share[fit.law] for fit in found.fits])
    even = Identified(found.fits, np.array([0.25, 0.75]))
    forces, deviations = np.array([fit.posterior.component(np.array([0.0, -1.0])) for fit in found.fits]).T
    force = even.force
    mean = 0.25 * forces[0] + 0.75 * forces[1]
    variance = np.array([0.25, 0.75]) @ (deviations**2 + (forces - mean) ** 2)
    assert force.force.value == pytest.approx(mean)
    assert force.force.high - mean == pytest.approx(1.95996 * np.sqrt(variance), rel=1e-4)
    # The place is where the force acts: the contact's middle plus the eccentricity of the force.
    which = [found.best.model.unknowns.names.index(name) for name in ("position", "eccentricity")]
    places = [float(fit.estimate.values[which].sum()) for fit in found.fits]
    joint = found.best.estimate.slopes[which]
    spread = joint @ found.best.estimate.covariance[np.ix_(which, which)] @ joint
    wall = 0.25 * mean_thickness(problem.mesh)
    assert found.best.posterior.place == pytest.approx((places[0], np.hypot(np.sqrt(spread), wall)))
    assert force.position.value == pytest.approx(0.25 * places[0] + 0.75 * places[1])
    assert force.position.low < min(places) < max(places) < force.position.high


def test_the_variance_of_the_force_is_the_sum_of_what_it_comes_from(identified):
    """Of a body with a depth the plane state is most of it, as ν² / 2 of the force."""
    observed, _, solution = identified
    shares, stroke = {}, np.array([0.0, -1.0])
    for finger in (None, Design()):
        problem = replace(solution.problem, observations=None, finger=finger)
        identifier = Identifier(
            FemIdSolver(degree=1, law="given"), problem, lambda unknowns: FemBody(unknowns, 1)
        )
        found = identifier.identify(observed)
        (value, deviation), parts = (
            found.best.posterior.component(stroke),
            found.best.posterior.variances(stroke),
        )
        assert value == pytest.approx(-found.best.response.hypothesis.force[1])
        assert sum(parts.values()) == pytest.approx(deviation**2)
        assert all(part >= 0 for part in parts.values())
        shares[finger is not None] = found.force.shares
        assert sum(found.force.shares.values()) == pytest.approx(1)
    assert shares[False]["third dimension"] < 0.1  # by what few elements leave
    assert next(iter(shares[True])) == "third dimension"
    # The observations of a body without a depth are most of the rest, and no frame was to be found.
    assert shares[False]["markers"] > 0.2
    assert shares[False]["frames"] == 0
    said = f"comes from: {100 * shares[True]['third dimension']:.0f} % the third dimension"
    assert said in found.force.advice


@pytest.mark.slow
def test_a_wrong_marker_is_found_and_not_used(identified, problem):
    observed, true, right = identified
    moved = observed.displacements.copy()
    moved[5] += [1.6, -1.2]
    solution = sought(problem, replace(observed, displacements=moved))
    assert "MARKER 6 of those seen CONTRADICTS the others by 2 mm: not used" in solution.status.message
    assert solution.stats["inflation"] == 1
    assert solution.stats["force"] == pytest.approx(right.stats["force"], rel=0.1)
    np.testing.assert_allclose(solution.left_out[5], right.left_out[5], atol=5 * NOISE)
    assert -true.hypothesis.force[1] < solution.stats["force_high"]


def test_a_law_that_gets_lost_on_the_way_leaves_it_to_the_other(identified, problem, monkeypatch):
    started = Identifier._started

    def lost(self, law, measurement):
        if law == "neo-hookean":
            raise NoSolutionError("no equilibrium near the markers")
        return started(self, law, measurement)

    monkeypatch.setattr(Identifier, "_started", lost)
    solution = sought(problem, identified[0])
    assert solution.problem.material.law == "st-venant-kirchhoff"
    assert "no equilibrium of the neo-hookean law" in solution.status.message


def test_without_any_law_it_has_no_solution(identified, problem, monkeypatch):
    def failed(*_, **__):
        raise NoSolutionError("no equilibrium of the law")

    monkeypatch.setattr(LawFits, "fit", failed)
    with pytest.raises(NoSolutionError, match="no equilibrium of the"):
        sought(problem, identified[0])


def test_a_search_ends_where_few_hypotheses_have_an_equilibrium(identified, problem, monkeypatch):
    """Beyond a limit load it would halve its steps for a minute."""
    asked = []

    def response(self, values, *arguments, **options):
        self.evaluations += 1
        asked.append(values)
        return known(self, values, *arguments, **options) if len(asked) < 3 else None

    known = ResponseModel.response
    monkeypatch.setattr(ResponseModel, "response", response)
    with pytest.raises(NoSolutionError, match="see whether the markers are of this finger and load"):
        sought(problem, identified[0], law="given")
    assert len(asked) <= MOST_LOST + 4 * len(STARTS)


def test_a_law_without_an_equilibrium_where_another_one_has_it_is_left_out_at_once(problem, monkeypatch):
    """From the state of the other law and from rest; a search from rest alone would take minutes."""
    observed, _ = twin(problem, LAWS[0], {"normal_force": 0.18})
    asked, known = [], ResponseModel.response

    def response(self, values, *arguments, **options):
        if self.unknowns.problem.material.law == LAWS[0]:
            return known(self, values, *arguments, **options)
        self.evaluations += 1
        asked.append(values)
        return None

    monkeypatch.setattr(ResponseModel, "response", response)
    solution = sought(problem, observed)
    assert solution.problem.material.law == LAWS[0]
    assert "no equilibrium of the st-venant-kirchhoff law" in solution.status.message
    assert "probability st-venant-kirchhoff" not in solution.stats
    assert len(asked) <= 3


def test_three_hidden_markers_open_the_intervals(identified, problem):
    observed, true, right = identified
    visible = ~np.isin(np.arange(9), (2, 5, 8))
    solution = sought(problem, replace(observed, visible=visible))
    widths = [each.stats["force_high"] - each.stats["force_low"] for each in (solution, right)]
    assert widths[0] > widths[1]
    assert solution.stats["force_low"] < -true.hypothesis.force[1] < solution.stats["force_high"]
    assert np.isnan(solution.left_out[[2, 5, 8]]).all()


@pytest.mark.slow
def test_no_load_is_no_force(problem):
    """Noise alone: the interval of the force holds zero, and nothing is said to be known of the place."""
    noise = NOISE * np.random.default_rng(3).normal(size=(9, 2))
    solution = sought(problem, observed_at(problem.mesh.markers, noise, NOISE))
    assert solution.stats["normal_force_low"] < 0 < solution.stats["normal_force_high"]
    assert solution.stats["force"] < 0.002
    assert "NOT DETERMINED by the markers, but held by its prior: position" in solution.status.message


@pytest.mark.slow
def test_on_a_fine_mesh_the_unknowns_are_sought_on_a_coarse_one(monkeypatch):
    """The result is that of the fine mesh, of which few systems are solved."""
    design = Design()
    mesh = finger_mesh(design, settings=MeshSettings(size=0.5))
    problem = Problem(mesh, Material(law="neo-hookean"), Load(displacement=(None, -6.0)), finger=design)
    observed, _ = twin(problem, "neo-hookean", TRUE)
    sizes, linearised = [], FemBody.linearised

    def counted(self, *arguments):
        sizes.append(len(self.space.mesh.triangles))
        return linearised(self, *arguments)

    monkeypatch.setattr(FemBody, "linearised", counted)
    found = {}
    for fine in (10**9, 1000):
        monkeypatch.setattr(nested_path, "FINE", fine)
        solution = sought(problem, observed, law="given")
        found[fine] = solution, sizes.count(len(mesh.triangles))
        sizes.clear()
    (alone, many), (nested, few) = found.values()
    assert few < many / 2
    assert nested.status.converged
    # The search alone ends within 1e-4 of the least cost, a few hundredths of a standard deviation away.
    for name in ("position", "normal_force", "rib_thickness"):
        off = abs(nested.stats[name] - alone.stats[name])
        assert off < 0.1 * alone.stats[f"{name}_deviation"]
    moved = [each.displacement(mesh.markers) for each in (nested, alone)]
    np.testing.assert_allclose(*moved, atol=0.1 * NOISE)
