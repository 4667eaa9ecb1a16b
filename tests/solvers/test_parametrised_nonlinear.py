"""The finger at finite strain as a function of its parameters: Taylor tests and `fem-nonlinear`."""

from dataclasses import replace

import numpy as np
import pytest

from geometry.errors import UserError
from solvers.fem.finite_strain.solver import FemNonlinearSolver
from solvers.fem.identification import finite_strain_model
from solvers.fem.identification.finite_strain_model import PARAMETERS, FiniteStrainModel
from solvers.fem.identification.parameters import parameters_of, problem_with
from solvers.fem.identification.solver import FemIdSolver
from solvers.lagrange import LagrangeSpace
from solvers.problem import Load, Material, Problem
from tests.solvers.conftest import observed_at, taylor_remainders

PLACE = {"position": 36.1, "stroke_u": -0.6, "stroke_v": -5.5, "poisson": 0.42, "young": 10.0}


@pytest.fixture(scope="module")
def problem(coarse_mesh):
    return Problem(coarse_mesh, Material(law="neo-hookean"), Load(displacement=(0.0, -6.0)))


@pytest.fixture(scope="module")
def finger(problem):
    finger = FiniteStrainModel(problem, LagrangeSpace(problem.mesh, 1), PARAMETERS)
    yield finger
    finger.close()


@pytest.fixture(scope="module")
def direct(problem):
    """The same problem by `fem-nonlinear`, from rest."""
    return FemNonlinearSolver(degree=1).solve(problem_with(problem, PLACE))


def place():
    return np.array([PLACE[name] for name in PARAMETERS])


def test_it_is_fem_nonlinear_from_rest_and_from_elsewhere(finger, direct):
    there = place() + np.array([1.0, 0.5, -0.5, 0.02, 1.0])
    for start in (None, there):
        if start is not None:
            finger.response(start)
        response = finger.response(place())
        np.testing.assert_allclose(response.nodal, direct.field.values, atol=1e-6)
        np.testing.assert_allclose(response.forces, direct.reaction, rtol=1e-6)
        assert response.energy == pytest.approx(direct.energy, rel=1e-6)


@pytest.mark.parametrize("name", PARAMETERS)
def test_derivatives_pass_the_taylor_test(problem, finger, name):
    """What the first-order expansion leaves falls by four when the step is halved, or is rounding."""
    which = PARAMETERS.index(name)
    scale = parameters_of(problem, [name])[0].derivative(0.0)
    first, second = taylor_remainders(finger, place(), which, scale)
    if name == "young":  # displacements do not depend on it, and forces are linear in it
        assert first.max() < 1e-6
        return
    np.testing.assert_allclose(first / second, 4.0, rtol=0.1)


def test_a_twin_at_finite_strain_is_found(problem, direct):
    """The stroke from 20 % off, without noise; what the prior pulls is little."""
    markers = problem.mesh.markers
    observations = observed_at(markers, direct.displacement(markers), 0.01)
    own = problem_with(problem, {"poisson": PLACE["poisson"]})
    names = ("position", "stroke_u", "stroke_v")
    solver = FemIdSolver("fem-nonlinear", ",".join(names), degree=1, marker_radius=0.0)
    solution = solver.solve(replace(own, observations=observations))
    for name in names:
        assert solution.stats[name] == pytest.approx(
            PLACE[name], abs=0.1 * solution.stats[f"{name}_deviation"]
        )
    np.testing.assert_allclose(solution.displacement(markers), direct.displacement(markers), atol=1e-3)
    assert solution.problem.material.law == "neo-hookean"
    assert "NOT DETERMINED" not in solution.status.message


def test_a_load_that_the_finger_cannot_take_is_an_error(problem, monkeypatch):
    """In one step it cannot."""
    one_step = FemNonlinearSolver(first_step=1.0, max_step=1.0, min_step=1.0)
    monkeypatch.setattr(finite_strain_model, "SOLVER", one_step)
    finger = FiniteStrainModel(problem, LagrangeSpace(problem.mesh, 1), ("stroke_v",))
    with pytest.raises(UserError, match=r"found no equilibrium beyond .* take a smaller prior or model=fem"):
        finger.response(np.array([-90.0]))
    finger.close()


def test_the_laws_are_those_of_the_model():
    assert FemIdSolver().laws == ("linear",)
    assert FemIdSolver("fem-nonlinear").laws == FemNonlinearSolver.laws


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"model": "pinn-std"}, "model must be fem or fem-nonlinear, got 'pinn-std'"),
        (
            {"model": "fem-nonlinear", "parameters": "rib_stiffness,position,base_compliance"},
            "finds base_compliance, rib_stiffness with model=fem only",
        ),
    ],
)
def test_models_and_their_parameters(settings, said):
    with pytest.raises(UserError, match=said):
        FemIdSolver(**settings)


def test_without_markers_it_is_fem_nonlinear(problem):
    small = replace(problem, load=Load(displacement=(0.0, -1.0)))
    plain = FemIdSolver("fem-nonlinear", degree=1).solve(small)
    np.testing.assert_array_equal(plain.field.values, FemNonlinearSolver(degree=1).solve(small).field.values)
    assert plain.status.message.startswith("without markers, this is fem-nonlinear: all of the load applied")
