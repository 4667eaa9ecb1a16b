"""`fem-id` with the linear model: twin experiments, and what is said where parameters cannot be found."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.stats import binom

from geometry.errors import UserError
from solvers.assimilation.misfit import MIN_STANDARD_DEVIATION, misfit_of
from solvers.fem.identification.linear_model import LinearModel
from solvers.fem.identification.solver import FemIdSolver
from solvers.fem.linear import FemSolver
from solvers.lagrange import LagrangeField, LagrangeSpace
from solvers.problem import Load, Problem
from tests.solvers.conftest import observed_at

NOISE = 0.01
TRUTH = {"position": 37.3, "stroke_u": -0.8, "stroke_v": -9.6}


@pytest.fixture(scope="module")
def problem(coarse_mesh):
    return Problem(coarse_mesh)


def twin(problem, truth, *, noise=0.0, deviation=NOISE, seed=0, degree=1):
    """The problem with observations of a finger that has the parameters `truth`; and its force along y."""
    space = LagrangeSpace(problem.mesh, degree)
    response = LinearModel(problem, space, tuple(truth)).response(np.array(list(truth.values())))
    markers = problem.mesh.markers
    moved = LagrangeField(space, response.nodal).displacement(problem.mesh.locate(markers))
    moved = moved + noise * np.random.default_rng(seed).normal(size=moved.shape)
    return replace(problem, observations=observed_at(markers, moved, deviation)), response.forces[1]


def solver(*names, **settings):
    settings = {"model": "fem", "degree": 1, "marker_radius": 0.0} | settings
    return FemIdSolver(parameters=",".join(names), **settings) if names else FemIdSolver(**settings)


def test_parameters_of_a_twin_are_found(problem):
    """Without noise they are off by what the prior pulls: little if it is weak."""
    truth = TRUTH | {"base_compliance": 0.4, "back_stiffness": 0.7, "rib_stiffness": 1.2}
    solution = solver(*truth, prior=4.0).solve(twin(problem, truth)[0])
    for name, value in truth.items():
        assert abs(solution.stats[name] - value) < 0.1 * solution.stats[f"{name}_deviation"]
        assert solution.stats[f"{name}_resolution"] > 0.8
    assert solution.status.converged
    assert solution.stats["inflation"] == 1


def test_the_solution_is_that_of_the_problem_with_what_was_found(problem):
    observed = twin(problem, TRUTH, noise=NOISE)[0]
    solution = solver().solve(observed)
    load = solution.problem.load
    assert [load.position, *load.displacement] == [solution.stats[name] for name in TRUTH]
    fem = FemSolver(degree=1, estimate=False).solve(Problem(problem.mesh, load=load))
    np.testing.assert_allclose(solution.field.values, fem.field.values, atol=1e-8)
    np.testing.assert_allclose(solution.reaction, fem.reaction, rtol=1e-7)
    assert solution.energy == pytest.approx(fem.energy, rel=1e-8)


def test_intervals_cover_the_truth_over_draws_of_the_noise(problem):
    """40 draws of 0.01 mm; the band holds 99.9 % of the binomial."""
    draws, inside, random = 40, 0, np.random.default_rng(6)
    exact = twin(problem, TRUTH)[0]
    for _ in range(draws):
        moved = exact.observations.displacements + NOISE * random.normal(size=(9, 2))
        observed = replace(exact, observations=replace(exact.observations, displacements=moved))
        stats = solver().solve(observed).stats
        inside += sum(stats[f"{name}_low"] < value < stats[f"{name}_high"] for name, value in TRUTH.items())
    low, high = binom.interval(0.999, 3 * draws, 0.95)
    assert low <= inside <= high


def test_a_dense_least_squares_by_finite_differences_finds_the_same(problem):
    """`fem` solved anew for every step, with the objective written out here."""
    observed = twin(problem, TRUTH, noise=NOISE)[0]
    target = observed.observations.displacements

    def residuals(z):
        position, u, v = np.array([35.0, 0.0, -10.0]) + np.array([2.0, 2.0, 2.0]) * z
        load = Load(position=position, displacement=(u, v))
        fem = FemSolver(degree=1, estimate=False).solve(Problem(problem.mesh, load=load))
        return np.append((fem.displacement(problem.mesh.markers) - target).ravel() / NOISE, z)

    dense = least_squares(residuals, np.zeros(3), jac="3-point", diff_step=1e-4)
    stats = solver().solve(observed).stats
    for name, z, start in zip(TRUTH, dense.x, (35.0, 0.0, -10.0), strict=True):
        assert stats[name] == pytest.approx(start + 2 * z, abs=0.01 * stats[f"{name}_deviation"])


def test_young_needs_a_force(problem):
    with pytest.raises(UserError, match=r"cannot find young from displacements alone.* give reaction="):
        solver("young")
    truth = {"stroke_v": -9.5, "young": 8.0}
    observed, force = twin(problem, truth)
    solution = solver(*truth, reaction=force).solve(observed)
    assert solution.stats["young"] == pytest.approx(8.0, rel=2e-3)
    assert solution.problem.material.young == solution.stats["young"]
    assert solution.reaction[1] == pytest.approx(force, rel=2e-3)
    relative = solution.stats["young_deviation"] / solution.stats["young"]
    assert relative == pytest.approx(0.02, rel=0.1)  # that of the force


def test_the_force_of_a_free_component_cannot_be_measured(problem):
    observed = replace(twin(problem, TRUTH)[0], load=Load(displacement=(-1.0, None)))
    with pytest.raises(UserError, match="v of the load is free, so that there is no reaction"):
        solver("position", reaction=-1.0).solve(observed)


def test_what_the_markers_do_not_tell_is_said_loudly_and_held(problem):
    observed = twin(problem, {"stroke_v": -9.98})[0]
    solution = solver("stroke_v", "poisson", prior=0.02).solve(observed)
    assert "NOT DETERMINED by the markers, but held by its prior: poisson" in solution.status.message
    assert "least is known of 1.00 poisson, singular value 0." in solution.status.message
    assert solution.stats["poisson"] == pytest.approx(0.45, abs=0.01)
    assert solution.stats["singular_value_2"] < 1
    clear = solver("stroke_v").solve(observed)
    assert "NOT DETERMINED" not in clear.status.message


def test_a_model_that_cannot_explain_the_markers_says_so_and_widens_its_intervals(problem):
    """The stroke alone, where the contact has moved too."""
    observed = twin(problem, TRUTH, noise=NOISE)[0]
    wrong, right = solver("stroke_v").solve(observed), solver().solve(observed)
    assert right.stats["inflation"] == 1
    assert wrong.stats["inflation"] > 10
    assert "the model is wrong elsewhere" in wrong.status.message
    assert wrong.stats["stroke_v_deviation"] > 5 * right.stats["stroke_v_deviation"]


def test_markers_that_were_not_seen_change_nothing(problem):
    observed = twin(problem, TRUTH, noise=NOISE)[0]
    observations = observed.observations
    hidden = np.ones(9, dtype=bool)
    hidden[4] = False
    moved = observations.displacements.copy()
    moved[4] = 1e6
    kept = observed_at(observations.points[hidden], observations.displacements[hidden], NOISE)
    masked = replace(observations, displacements=moved, visible=hidden)
    solutions = [solver().solve(replace(observed, observations=each)) for each in (masked, kept)]
    np.testing.assert_array_equal(solutions[0].field.values, solutions[1].field.values)
    assert np.isnan(solutions[0].left_out[4]).all()


def test_a_marker_left_out_in_closed_form_is_nearly_that_of_a_refit(problem):
    """The position bends the model: to a tenth of the noise."""
    observed = twin(problem, TRUTH, noise=NOISE)[0]
    solution = solver().solve(observed)
    for marker in (0, 8):
        visible = np.ones(9, dtype=bool)
        visible[marker] = False
        without = replace(observed, observations=replace(observed.observations, visible=visible))
        refitted = solver().solve(without).displacement(problem.mesh.markers)[marker]
        np.testing.assert_allclose(solution.left_out[marker], refitted, atol=0.1 * NOISE)


def test_simulated_markers_count_as_known_to_the_smallest_deviation(problem):
    zero, least = (
        solver().solve(twin(problem, TRUTH, noise=1e-3, deviation=deviation)[0])
        for deviation in (0.0, MIN_STANDARD_DEVIATION)
    )
    assert dict(zero.stats) | {"seconds": 0} == dict(least.stats) | {"seconds": 0}


def test_a_marker_is_the_mean_over_its_disc(problem):
    observed = twin(problem, TRUTH)[0]
    solution = solver(marker_radius=0.8).solve(observed)
    points, weights = misfit_of(observed).sampling()
    missed = weights @ solution.displacement(points) - observed.observations.displacements
    told = float(solution.status.message.split("missed by ")[1].split()[0])
    assert told == pytest.approx(np.sqrt((missed**2).mean()), rel=0.1)


def test_without_markers_it_is_fem(problem):
    plain, fem = solver().solve(problem), FemSolver(degree=1, estimate=False).solve(problem)
    np.testing.assert_array_equal(plain.field.values, fem.field.values)
    assert plain.solver == "fem-id"
    assert plain.status.message.startswith("without markers, this is fem: ")
    assert solver().laws == ("linear",)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"model": "pinn-std"}, "model must be fem-nonlinear or fem, got 'pinn-std'"),
        ({"degree": 3}, "elements of degree 1 and 2, not 3"),
        ({"prior": 0.0}, "prior must be positive"),
        ({"reaction": 0.0}, "a force other than zero"),
        ({"reaction": -1.0, "reaction_error": np.nan}, "reaction_error must be positive"),
        ({"marker_radius": -1.0}, "marker_radius must be zero or more"),
    ],
)
def test_settings_that_make_no_sense_are_refused(settings, said):
    with pytest.raises(UserError, match=said):
        FemIdSolver(**settings)
