"""Pictures in unknown frames: the joint normal distribution, and the joint least energy plus misfit."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.geometry.picture_frame import FIXED, PARTS, Homography, Pictures, Registration
from pinnray.solvers.assimilation.picture_frames import FreePictures
from pinnray.solvers.problem import Load, Problem
from pinnray.solvers.registry import make_solver
from pinnray.solvers.statistics.posterior import Posterior
from tests.solvers.conftest import hiding, observed_at
from tests.solvers.contract.test_contract import QUICK
from tests.solvers.statistics.kernels import matern

KNOWN = Registration(turn=3.0, shift=0.3, scale=0.01, tilt=0.01)
OFF = np.array([2.5, 0.3, -0.2, -0.012, 0.01, -0.005])  # degrees, mm, shares


@pytest.fixture(scope="module")
def problem(coarse_mesh):
    return Problem(coarse_mesh, load=Load(displacement=(0.0, -6.0)))


def pictured(problem, off, drawn=0.0):
    """What turned, shifted and scaled pictures show of linear `fem`, and the displacements themselves."""
    points = problem.mesh.markers
    moved = make_solver("fem", estimate=False).solve(problem).displacement(points)
    centre = points.mean(axis=0)
    pictures = Pictures(Homography(centre, off), Homography(centre, np.array([0, 0, 0, drawn, 0, 0])))
    observed = observed_at(points, pictures.shown(points, moved), 0.01)
    return replace(observed, pressed=KNOWN), moved


def test_pictures_show_what_is_their_own(problem):
    observed, moved = pictured(problem, OFF, drawn=0.02)
    centre = observed.points.mean(axis=0)
    pictures = Pictures(Homography(centre, OFF), Homography(centre, np.array([0, 0, 0, 0.02, 0, 0])))
    own = pictures.own(observed.points, observed.displacements)
    np.testing.assert_allclose(own, moved, atol=1e-12)


def test_observations_are_linear_in_the_frames(problem):
    """By steps of one standard deviation: the finger's displacements are observed minus frames z."""
    observed, _ = pictured(problem, OFF)
    free = FreePictures.of(replace(observed, drawn=Registration(turn=0.5, shift=0.1, scale=0.005)))
    assert len(free.parameters) == 10
    z = np.linspace(-1, 1, 10)
    framed = free.about(z)
    for step in 0.001 * np.eye(10):
        own = free.at(z + step).own(observed.points, observed.displacements)
        linear = framed.observed - np.tensordot(z + step, framed.frames, axes=1)
        np.testing.assert_allclose(linear, own, atol=2e-7)
    assert FreePictures.of(replace(observed, pressed=FIXED)).parameters == []


def test_frames_are_those_of_the_joint_normal_distribution(problem):
    """Of `gp`: mean and covariance of z given the observations, from the covariance of both together."""
    observed, _ = pictured(problem, OFF)
    posterior = make_solver("gp", clamp=True).solve(replace(problem, observations=observed)).field
    assert isinstance(posterior, Posterior)
    data, count = posterior.data, 2 * len(posterior.data.points)
    assert count == 28
    process = np.zeros((count, count))
    for axis, length in enumerate(posterior.lengths):
        process[axis::2, axis::2] = posterior.variances[axis] * matern(data.points, data.points, length)
    frames = data.frames.reshape(6, count)
    whole = process + 0.01**2 * np.eye(count) + frames.T @ frames
    mean, covariance = posterior.frames
    np.testing.assert_allclose(mean, frames @ np.linalg.solve(whole, data.observed.ravel()), atol=1e-6)
    expected = np.eye(6) - frames @ np.linalg.solve(whole, frames.T)
    np.testing.assert_allclose(covariance, expected, atol=1e-6)


@pytest.mark.slow
def test_a_turned_picture_is_found(problem):
    """`gp` knows of it only by the base at rest."""
    observed, _ = pictured(problem, OFF)
    made = make_solver("gp", clamp=True)
    found = made.solve(replace(problem, observations=observed))
    for part, value in zip(PARTS, OFF, strict=True):
        name = f"pressed_{part}"
        assert found.stats[f"{name}_low"] < value < found.stats[f"{name}_high"], name
    field = found.displacement(observed.points)
    np.testing.assert_allclose(found.shown(observed.points, field), observed.displacements, atol=0.03)
    as_it_is = made.solve(replace(problem, observations=replace(observed, pressed=FIXED)))
    assert as_it_is.pictures is None


@pytest.mark.slow
def test_a_marker_left_out_is_predicted_in_its_picture(problem):
    """Its deviation has a part by the frame."""
    observed, _ = pictured(problem, OFF)
    hidden = hiding(replace(problem, observations=observed), 4)
    made, seen = make_solver("gp"), hidden.observations.visible
    found = made.solve(hidden)
    there = problem.mesh.locate(observed.points)
    shown = found.uncertainty.shown(there)
    seen_there = found.shown(observed.points, found.displacement(there))[[4]]
    assert shown[seen].max() < 0.011  # as exactly as it was seen
    whole = made.solve(replace(problem, observations=observed))
    np.testing.assert_allclose(whole.left_out[[4]], seen_there, atol=1e-4)
    fixed = made.solve(replace(problem, observations=replace(observed, pressed=FIXED)))
    assert fixed.uncertainty.shown is None


@pytest.mark.slow
@pytest.mark.parametrize("weights", ["paper", "precision"])
def test_the_frames_of_fem_asm_are_those_of_the_least_energy_plus_misfit(problem, weights):
    """Half the squared standardised values times the scale is the frames' part of it."""
    observed, _ = pictured(problem, OFF)
    made = make_solver("fem-asm", weights=weights, scale=2.0)
    found = made.solve(replace(problem, observations=observed))
    pictures = FreePictures.of(observed)
    deviations = KNOWN.deviations
    z = np.array([found.stats[each.name] for each in pictures.parameters]) / deviations

    def least(z):
        straight = pictures.straightened(observed, z)
        solution = made.solve(replace(problem, observations=straight))
        return solution.energy + solution.stats["misfit"] + 0.5 * 2.0 * float(z @ z)

    own = least(z)
    for step in 0.03 * np.vstack([np.eye(6), -np.eye(6)]):
        assert own < least(z + step)
    np.testing.assert_allclose(found.pictures.pressed.values, z * deviations, atol=1e-9)
    assert found.problem.observations is observed


def test_a_marker_is_left_out_of_the_frames_as_well(problem):
    """As if it had not been seen, to first order in what it changes of the frames."""
    observed, _ = pictured(problem, OFF)
    made, given = make_solver("fem-asm", weights="precision"), replace(problem, observations=observed)
    whole = made.solve(given)
    for marker in (0, 4, 8):
        without = made.solve(hiding(given, marker))
        one = observed.points[[marker]]
        predicted = without.shown(one, without.displacement(one))[0]
        np.testing.assert_allclose(whole.left_out[marker], predicted, atol=0.02)


@pytest.mark.slow
def test_the_network_finds_the_frames_of_its_twin(problem):
    observed, _ = pictured(problem, OFF)
    found = [
        make_solver(name, weights="precision", **settings).solve(replace(problem, observations=observed))
        for name, settings in (("fem-asm", {}), ("pinn-asm", QUICK["pinn-asm"]))
    ]
    turns = [each.stats["pressed_turn"] for each in found]
    assert turns[0] > 1  # of 2.5: at this scale the finger may bend for it
    assert turns[1] == pytest.approx(turns[0], abs=0.1)
    shown = [each.shown(observed.points, each.displacement(observed.points)) for each in found]
    np.testing.assert_allclose(shown[1], shown[0], atol=0.03)
