"""A finger under a cylinder with friction: its equilibria, their derivatives, and what markers tell."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.fem.identification import FemBody, FemIdSolver
from pinnray.solvers.identification.cylinder_model import CylinderModel
from pinnray.solvers.identification.model import EXACT
from pinnray.solvers.identification.unknowns import CYLINDER, Unknowns
from pinnray.solvers.problem import Load
from tests.solvers.conftest import observed_at
from tests.solvers.identification.twins import NOISE, values_of

LOAD = Load("cylinder", radius=10.0, stroke=6.0, friction=0.4)
NAMES = (*CYLINDER, "front_thickness", "rib_thickness", "base_compliance", "poisson")


@pytest.fixture(scope="module")
def pressed(problem):
    """The default finger on coarse linear elements."""
    unknowns = Unknowns(replace(problem, load=LOAD), NAMES)
    return CylinderModel(FemBody(unknowns, 1), unknowns)


@pytest.fixture(scope="module")
def found(pressed):
    values = values_of(pressed.unknowns, {"base_compliance": 1e-9})
    response = pressed.response(values, EXACT)
    assert response is not None
    return response


def test_the_force_is_that_of_the_solver_that_follows_the_load(problem, found):
    """The steps differ, and with them the way of friction: by 2e-4 of the force."""
    other = FemNonlinearSolver(degree=1).solve(replace(problem, load=LOAD))
    np.testing.assert_allclose(found.force, other.reaction, rtol=1e-3)
    assert found.place == pytest.approx(other.contact.position, abs=0.02)


@pytest.mark.parametrize("friction", [0.4, 1.5])
def test_derivatives_are_those_of_differences(pressed, friction):
    """Of state, force and place, along the whole way with its friction; 3e-5 is what differences leave."""
    pressed.restart(None)
    found = pressed.response(values_of(pressed.unknowns, {"friction": friction}), EXACT)
    axes = pressed._cylinder(found.hypothesis, 1.0).axes(pressed._moved(found.state))
    q, t = (found.way[-1].forces * axes).sum(axis=2)
    assert (np.abs(t) < 0.999 * friction * q).any() == (friction > 1)  # what sticks
    for number, parameter in enumerate(pressed.unknowns.parameters(1.0)):
        step = 1e-4 * max(abs(found.values[number]), 1.0) * np.eye(len(NAMES))[number]
        if parameter.name == "base_compliance":
            continue  # it moves the finger as a whole, which `test_model` has
        ends = []
        for way in (1, -1):
            pressed.restart(found)
            ends.append(pressed.response(found.values + way * step, 1e-8))
        for name in ("state", "force", "place"):
            slope = (getattr(ends[0], name) - getattr(ends[1], name)) / (2 * step.sum())
            exact = {"state": found.slopes, "force": found.force_slopes, "place": found.place_slopes}[name]
            np.testing.assert_allclose(exact[number], slope, atol=1e-4 * np.abs(slope).max() + 1e-9)


def test_markers_tell_place_travel_and_friction(problem, pressed, found):
    """A truth by the solver that follows the load, whose cylinder went farther than is stated."""
    true = {"position": 37.0, "travel": 6.4, "friction": 0.7}
    load = LOAD.model_copy(update={"displacement": (0.0, -6.4), "friction": 0.7, "position": 37.0})
    truth = FemNonlinearSolver(degree=1).solve(replace(problem, load=load))
    markers = problem.mesh.markers
    moved = truth.displacement(markers) + NOISE * np.random.default_rng(0).normal(size=markers.shape)
    told = replace(problem, load=Load("cylinder", radius=10.0, stroke=6.0))
    solver = FemIdSolver(degree=1, law="given", sides="plane")
    solution = solver.solve(replace(told, observations=observed_at(markers, moved, NOISE)))
    assert solution.identified.contact == "cylinder"
    assert solution.stats["probability cylinder"] > 0.99
    for name, value in true.items():
        assert solution.stats[f"{name}_low"] < value < solution.stats[f"{name}_high"]
    assert solution.stats["travel"] == pytest.approx(6.4, abs=0.1)
    force, across = -truth.reaction[1], truth.reaction[0]
    assert solution.identified.force.low < force < solution.identified.force.high
    assert solution.identified.tangential_force.low < across < solution.identified.tangential_force.high


def test_a_cylinder_has_its_unknowns_in_place_of_those_of_a_patch():
    assert FemIdSolver(parameters="normal_force,poisson").under_cylinder == ("travel", "friction", "poisson")
    assert FemIdSolver(parameters="position,normal_force").under_cylinder == CYLINDER
