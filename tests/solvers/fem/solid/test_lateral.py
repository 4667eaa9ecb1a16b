"""Sideways and torsional stiffness against closed forms of straight bars."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.solvers.extrusion import ExtrudedSpace
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.fem.solid import Fem3dSolver
from pinnray.solvers.problem import Load, Material, Problem
from tests.solvers.conftest import bar_mesh, beam_compliance

MATERIAL = Material(young=10.0, poisson=0.3)
SHEAR = 10.0 / 2.6
LENGTH, HEIGHT = 60.0, 4.0
ARM = LENGTH - 1.0


def bar(depth: float) -> Problem:
    """A bar clamped at its left end, pressed on the last 2 mm of its top."""
    mesh = replace(bar_mesh(LENGTH, HEIGHT, 30, 2, contact=(LENGTH - 2, LENGTH)), depth=depth)
    return Problem(mesh, MATERIAL, Load(displacement=(None, -0.1)))


def torsion_constant(long: float, short: float) -> float:
    """Saint-Venant's J of a rectangle, mm^4: Timoshenko, Goodier, Theory of Elasticity, article 109."""
    odd = np.arange(1, 200, 2)
    series = (np.tanh(odd * np.pi * long / (2 * short)) / odd**5).sum()
    return float(long * short**3 / 3 * (1 - 192 / np.pi**5 * short / long * series))


@pytest.mark.parametrize("depth", [3.0, 6.0])
def test_a_bar_twists_as_saint_venants(depth):
    found = Fem3dSolver(layers=2, lateral=True).solve(bar(depth)).lateral
    expected = SHEAR * torsion_constant(max(depth, HEIGHT), min(depth, HEIGHT)) / ARM
    assert found.torsional == pytest.approx(expected, rel=0.03)  # clamp and contact


@pytest.mark.parametrize("depth", [3.0, 6.0])
def test_a_bar_bends_sideways_as_timoshenkos(depth):
    """With its twist, because the force acts on the top, half of the height beside the axis."""
    found = Fem3dSolver(layers=2, lateral=True).solve(bar(depth)).lateral
    bending = beam_compliance(MATERIAL, MATERIAL.young, height=depth, arm=ARM) / HEIGHT
    twisting = ARM / (SHEAR * torsion_constant(max(depth, HEIGHT), min(depth, HEIGHT)))
    assert 1 / found.sideways == pytest.approx(bending + (HEIGHT / 2) ** 2 * twisting, rel=0.02)


@pytest.mark.slow
def test_the_stiffness_does_not_depend_on_law_or_load():
    problem = bar(4.0)
    given = Fem3dSolver(layers=1, lateral=True).solve(problem).lateral
    load, law = Load(kind="patch", displacement=(0.0, -0.3)), {"law": "neo-hookean"}
    loaded = replace(problem, load=load, material=MATERIAL.model_copy(update=law))
    found = Fem3dSolver(layers=1, lateral=True).solve(loaded).lateral
    np.testing.assert_allclose(found, given, rtol=1e-6)


def test_a_slope_along_the_depth_is_found_exactly():
    mesh = replace(bar_mesh(10, 2, 5, 1, contact=(8, 10)), depth=3.0)
    space = ExtrudedSpace.of(mesh, 3, 0.25)
    weights = space.slope_value(np.array([[4.0, -1.0]]), np.ones(1))
    assert weights @ (0.7 * space.nodes[:, 2]) == pytest.approx(0.7)


def test_only_on_request_and_not_in_the_plane():
    assert Fem3dSolver(layers=1).solve(bar(4.0)).lateral is None
    assert FemSolver().solve(bar(4.0)).lateral is None
