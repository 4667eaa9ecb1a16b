"""The finger as a function of its parameters: Taylor tests, `fem`, equilibrium and energies by quadrature."""

from dataclasses import replace

import numpy as np
import pytest

from geometry.errors import UserError
from geometry.mesh.boundary import walls_and_ribs
from geometry.mesh.quadrature import body_quadrature, edge_quadrature
from solvers.elasticity import lame_constants, lame_derivatives
from solvers.fem.identification.linear_model import LinearModel
from solvers.fem.identification.linear_parameters import (
    MEANINGS,
    parameters_of,
    problem_with,
)
from solvers.fem.linear import FemSolver
from solvers.identification.hypothesis import parse_names
from solvers.lagrange import LagrangeField, LagrangeSpace
from solvers.problem import Load, Material, Problem
from solvers.solution import State
from tests.solvers.conftest import bar_mesh, taylor_remainders

NAMES = tuple(MEANINGS)


@pytest.fixture(scope="module")
def problem(coarse_mesh):
    return Problem(coarse_mesh)


@pytest.fixture(scope="module")
def space(coarse_mesh):
    return LagrangeSpace(coarse_mesh, 1)


@pytest.fixture(scope="module")
def finger(problem, space):
    return LinearModel(problem, space, NAMES)


@pytest.fixture(scope="module")
def place(problem):
    """Parameters away from their priors' middles."""
    return np.array(
        [float(u.value(-0.4 if u.name == "poisson" else 0.4)) for u in parameters_of(problem, NAMES)]
    )


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_lame_slopes_are_those_of_central_differences(plane):
    step, ν = 1e-6, 0.3
    high, low = (np.array(lame_constants(2.0, ν + way * step, plane)) for way in (1, -1))
    np.testing.assert_allclose(lame_derivatives(2.0, ν, plane), (high - low) / (2 * step), rtol=1e-8)


@pytest.mark.parametrize(
    ("load", "plane", "degree"),
    [
        (Load(), "strain", 2),
        (Load(displacement=(None, -4.0)), "stress", 1),
        (Load(kind="point", position=41.3, displacement=(1.0, -4.0)), "strain", 1),
    ],
)
def test_without_parameters_it_is_fem(coarse_mesh, load, plane, degree):
    problem = Problem(coarse_mesh, Material(plane=plane), load)
    response = LinearModel(problem, LagrangeSpace(coarse_mesh, degree), ()).response(np.zeros(0))
    fem = FemSolver(degree=degree, estimate=False).solve(problem)
    np.testing.assert_allclose(response.nodal, fem.field.values, atol=1e-8)
    np.testing.assert_allclose(response.forces, fem.reaction[load.prescribed], rtol=1e-8)
    assert response.energy == pytest.approx(fem.energy, rel=1e-9)


def test_load_and_material_are_those_of_a_problem_that_has_them(problem, space, finger, place):
    """`fem` with the same load and material, where clamp and walls are as usual."""
    names = ("position", "stroke_u", "stroke_v", "poisson", "young")
    values = dict(zip(names, (38.2, 0.7, -8.0, 0.4, 9.0), strict=True))
    response = LinearModel(problem, space, names).response(np.array(list(values.values())))
    fem = FemSolver(degree=1, estimate=False).solve(problem_with(problem, values))
    assert fem.problem.load == Load(position=38.2, displacement=(0.7, -8.0))
    assert fem.problem.material == Material(poisson=0.4, young=9.0)
    np.testing.assert_allclose(response.nodal, fem.field.values, atol=1e-8)
    np.testing.assert_allclose(response.forces, fem.reaction, rtol=1e-8)


@pytest.mark.parametrize("name", NAMES)
def test_derivatives_pass_the_taylor_test(problem, finger, place, name):
    """What the first-order expansion leaves falls by four when the step is halved, or is rounding."""
    which = NAMES.index(name)
    scale = parameters_of(problem, NAMES)[which].derivative(0.0)
    first, second = taylor_remainders(finger, place, which, scale)
    if name in ("stroke_u", "stroke_v", "young"):  # linear: nothing but rounding is left
        assert first.max() < 1e-6
        return
    np.testing.assert_allclose(first / second, 4.0, rtol=0.1)


def test_a_compliant_base_is_in_equilibrium_and_tends_to_the_clamp(problem, space):
    finger = LinearModel(problem, space, ("base_compliance",))
    compliance = 0.3
    response = finger.response(np.array([compliance]))
    points, weights = edge_quadrature(problem.mesh, "base")
    moved = LagrangeField(space, response.nodal).displacement(problem.mesh.locate(points))
    assert np.abs(moved).max() > 1e-3
    held = problem.material.young / compliance * weights @ moved
    np.testing.assert_allclose(held, response.forces, rtol=1e-8)
    clamped = FemSolver(degree=1, estimate=False).solve(problem).field.values
    distance = [np.linalg.norm(finger.response(np.array([soft])).nodal - clamped) for soft in (2e-4, 1e-4)]
    assert distance[0] / distance[1] == pytest.approx(2, rel=0.01)


@pytest.mark.parametrize("part", ["front", "back", "rib"])
def test_stiffening_a_part_costs_the_energy_that_it_holds(problem, space, part):
    """d/ds of the least energy is the energy of the part for s = 1, here by quadrature of its density."""
    response = LinearModel(problem, space, (f"{part}_stiffness",)).response(np.ones(1))
    change = 0.5 * response.force_slopes[0] @ problem.load.values
    rule = body_quadrature(problem.mesh)
    gradient = LagrangeField(space, response.nodal).gradient(rule.location)
    density = State.from_gradient(gradient, problem).energy_density
    here = walls_and_ribs(problem.mesh)[part][rule.location.cells]
    assert change == pytest.approx((rule.weights * density)[here].sum(), rel=1e-8)


def test_walls_and_ribs_have_the_areas_of_the_drawing(medium_mesh):
    """Walls of 2 mm beside cavities that end 2 mm from the base; ribs of 2 mm, 20 degrees from the normal."""
    areas = {name: medium_mesh.areas[mask].sum() for name, mask in walls_and_ribs(medium_mesh).items()}
    parts = walls_and_ribs(medium_mesh)
    centroids = medium_mesh.at_centroids().points
    assert not np.any(np.sum(list(parts.values()), axis=0) > 1)
    assert centroids[parts["front"], 1].min() > -2
    # From the base wall to the tip, 2 to 70 mm and a little less: triangles are taken whole.
    assert areas["front"] == pytest.approx(2 * 67, rel=0.03)
    assert areas["back"] == pytest.approx(2 * 68 / np.cos(np.arctan(1 / 3)), rel=0.03)
    # Four ribs between walls that leave 26 mm at the base: lengths fall with the distance from it.
    assert 80 < areas["rib"] < 130


def test_a_body_without_cavities_has_no_walls():
    mesh = bar_mesh(20.0, 2.0, 40, 4, contact=(18.0, 20.0))
    assert not any(mask.any() for mask in walls_and_ribs(mesh).values())
    with pytest.raises(UserError, match="no back beside cavities: leave out back_stiffness"):
        parameters_of(Problem(mesh), ("back_stiffness",))


def test_what_the_load_does_not_have_cannot_be_found(problem):
    free = replace(problem, load=Load(displacement=(None, -10.0)))
    with pytest.raises(UserError, match="u of the load is free, so that there is no stroke_u to find"):
        parameters_of(free, ("stroke_u",))
    assert [u.start for u in parameters_of(free, ("position", "stroke_v"))] == [35.0, -10.0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("position,mass", "fem-id has no parameter 'mass'; it has position, stroke_u"),
        ("young,young", "'young' is there twice"),
        (" , ", "needs at least one parameter"),
    ],
)
def test_parameters_that_are_none_are_refused(text, said):
    with pytest.raises(UserError, match=said):
        parse_names("fem-id", text, tuple(MEANINGS))


def test_the_contact_stays_on_the_front_face(problem):
    (position,) = parameters_of(problem, ("position",))
    for value in (position.low, position.high):
        problem_with(problem, {"position": value})  # which would be refused
