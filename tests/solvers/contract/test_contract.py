"""The contract of every solver, over all that are registered."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest

from pinnray.geometry.mesh.quadrature import body_quadrature
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.errors import OutsideBodyError, UserError
from pinnray.solvers.problem import Load, Material, Problem, contact_functional
from pinnray.solvers.registry import make_solver, solver_names, usable_solvers
from pinnray.solvers.solver import Solver, with_law
from tests.meshes import permuted
from tests.solvers.conftest import bar_mesh, beam_compliance, check_gradient
from tests.solvers.plugin.pinnray_skfem import SkfemSolver

LOCAL = {"preset": "local", "wall_spacing": 0.8, "corner_spacing": 0.2, "neurons": 4}
QUICK = {
    "fem-3d": {"sides": "held", "layers": 1},  # in plane strain, as all other solvers here
    "pinn-std": {"wall_spacing": 1.0, "corner_spacing": 0.2, "neurons": 4},
    "pinn-std local": LOCAL,
    "pinn-asm": {"wall_spacing": 1.0, "corner_spacing": 0.2, "neurons": 4, "tolerance": 1.0},
    "pinn-asm local": LOCAL | {"wall_spacing": 0.9, "corner_spacing": 0.3, "tolerance": 1.0},
}
"""Settings that make a solver quick enough for the tests."""

WITHOUT_ANSWER = {"gp", "pinn-id"}
"""Solvers that have nothing to say without markers, and nothing that this suite could test."""

MEANT_OVER_DEPTH = {"fem-3d": 8e-3}
"""Solvers whose load and energy are means over the depth, and by how much those of their field may differ.

Held side faces make a plane state of it but for the tetrahedra, which cut every prism differently at its two
ends: 0.0002 mm of 2 mm, and 0.6 % of the energy, on this mesh.
"""

NAMES = [
    *(name for name in dict.fromkeys([*solver_names(), "skfem-p2"]) if name not in WITHOUT_ANSWER),
    *("pinn-std local", "pinn-asm local"),
]
"""Ours, those of the packages that are installed, the package that lives in the tests, and presets."""

LOADS = {
    name: solver.loads for name, solver in [*usable_solvers().items(), (SkfemSolver.name, SkfemSolver())]
}
LOADS |= {f"{name} local": LOADS[name] for name in ("pinn-std", "pinn-asm") if name in LOADS}
"""Without the solvers whose packages this system lacks: `.ci/versions` runs where there is no torch."""

PAIRS = [(name, kind) for name in NAMES if name in LOADS for kind in ("mean", "point", "patch", "cylinder")]

ACCURACY = {
    **dict.fromkeys(("fem", "fem-asm", "fem-id", "skfem-p2"), 1e-8),
    **{"fem-nonlinear": 1e-6, "fem-3d": 1e-4},
}
"""Relative difference that two solutions of one problem may have: rounding, Newton's tolerance."""


def accuracy(solver):
    """That of the solver, or of a training."""
    return ACCURACY.get(solver.name, 0.02)


SLOW = ("fem-3d", "fem-id", "pinn-std local", "pinn-asm", "pinn-asm local")
"""Solvers that have a quicker one of their kind beside them."""


def case(name: str, *given: str):
    return pytest.param(name, *given, marks=[pytest.mark.slow] * (name in SLOW))


@pytest.fixture(scope="module", params=[case(name) for name in NAMES])
def solver(request, plugin_folder):
    sys.path.insert(0, str(plugin_folder))
    yield make_solver(request.param.partition(" ")[0], **QUICK.get(request.param, {}))
    sys.path.remove(str(plugin_folder))


def problem_of(solver: Solver, mesh: TriangleMesh, displacement=(0.0, -2.0)) -> Problem:
    return Problem(mesh, with_law(Material(), solver), Load(displacement=displacement))


@pytest.fixture(scope="module")
def solution(solver, short_mesh):
    return solver.solve(problem_of(solver, short_mesh))


def relative(difference, reference):
    return np.linalg.norm(difference) / np.linalg.norm(reference)


def test_every_registered_solver_is_in_this_suite(plugin_folder, monkeypatch):
    monkeypatch.syspath_prepend(str(plugin_folder))
    plain = {name for name in NAMES if " " not in name}
    assert set(usable_solvers()) == plain | WITHOUT_ANSWER == set(solver_names())


@pytest.mark.parametrize(
    ("solver", "kind"),
    [case(*each) for each in PAIRS if each[1] in LOADS[each[0]] and each[1] != "cylinder"],  # it has tests
    indirect=["solver"],
)
def test_every_load_that_the_solver_has_is_met_and_the_base_is_at_rest(solver, short_mesh, kind):
    problem = replace(problem_of(solver, short_mesh), load=Load(kind=kind, displacement=(0.0, -2.0)))
    solution = solver.solve(problem)
    base = short_mesh.points[np.unique(short_mesh.boundary("base"))]
    assert np.abs(solution.displacement(base)).max() < 1e-12
    if kind == "patch":
        contact = short_mesh.points[np.unique(short_mesh.boundary("contact"))]
        # A network prescribes moments of the displacement.
        assert np.abs(solution.displacement(contact) - [0.0, -2.0]).max() < 0.01
    else:
        points, weights = contact_functional(problem)
        atol = MEANT_OVER_DEPTH.get(solver.name, 1e-6)
        np.testing.assert_allclose(weights @ solution.displacement(points), [0.0, -2.0], atol=atol)


def test_energy_is_the_integral_of_its_density(solution, short_mesh):
    rule = body_quadrature(short_mesh, 4)
    total = (rule.weights * solution.state(rule.location).energy_density).sum()
    # The network's energy was integrated by a rule of degree 2.
    own = 0.02 if "quadrature_points" in solution.stats else 1e-7
    assert total == pytest.approx(solution.energy, rel=MEANT_OVER_DEPTH.get(solution.solver, own))


def test_reaction_does_the_work(solution):
    """Clapeyron: half the force times the travel; exact for a linear law, nearly so for a small travel."""
    work = 0.5 * solution.reaction @ [0.0, -2.0]
    linear = solution.problem.material.law == "linear"
    assert solution.energy == pytest.approx(work, rel=1e-5 if linear else 0.1)
    assert solution.reaction[1] < 0


@pytest.mark.slow
def test_twice_the_travel_is_twice_the_displacement(solver, solution, short_mesh):
    linear = solution.problem.material.law == "linear"
    travels = (2.0, 4.0) if linear else (0.01, 0.02)
    small, large = (
        solver.solve(problem_of(solver, short_mesh, (0.0, -travel))).displacement(short_mesh.markers) / travel
        for travel in travels
    )
    assert relative(large - small, small) < (1e-6 if linear else 0.01)


def test_numbering_of_the_mesh_does_not_matter(solver, solution, short_mesh):
    renumbered = solver.solve(problem_of(solver, permuted(short_mesh, 7)))
    expected = solution.displacement(short_mesh.markers)
    assert relative(renumbered.displacement(short_mesh.markers) - expected, expected) < ACCURACY.get(
        solver.name, 0.02
    )


def test_mirrored_finger_moves_the_other_way(solver, solution, short_mesh):
    mirror = np.array([1.0, -1.0])
    mirrored = replace(short_mesh, points=short_mesh.points * mirror, triangles=short_mesh.triangles[:, ::-1])
    other = solver.solve(problem_of(solver, mirrored, (0.0, 2.0)))
    expected = solution.displacement(short_mesh.markers) * mirror
    assert relative(other.displacement(mirrored.markers) - expected, expected) < ACCURACY.get(
        solver.name, 0.02
    )


def test_gradient_is_the_derivative_of_the_displacement(solution, short_mesh):
    check_gradient(solution, short_mesh.at_centroids().points[::50])


def test_points_outside_the_body_are_refused(solution):
    with pytest.raises(OutsideBodyError, match=r"outside the body.*\(10, -10\)"):
        solution.displacement([[10.0, -10.0]])  # in the first cavity


def test_one_point_and_many_points_agree(solution, short_mesh):
    """A network leaves out encoders with shares below 1e-8; they give several times the travel."""
    many, one = (solution.displacement(points) for points in (short_mesh.markers, short_mesh.markers[1:2]))
    np.testing.assert_allclose(one, many[1:2], rtol=0, atol=1e-6)


def test_settings_are_json_and_status_is_a_sentence(solver, solution):
    json.dumps(solver.settings())
    assert len(solution.status.message) > 10
    assert solution.stats["seconds"] > 0


@pytest.mark.parametrize(
    ("solver", "kind"), [case(*each) for each in PAIRS if each[1] not in LOADS[each[0]]], indirect=["solver"]
)
def test_a_load_that_the_solver_does_not_have_is_refused(solver, short_mesh, kind):
    load = Load(kind=kind, radius=5.0 if kind == "cylinder" else None, displacement=(0.0, -2.0))
    with pytest.raises(UserError, match=f"{solver.name} takes the loads"):
        solver.solve(replace(problem_of(solver, short_mesh), load=load))


def test_patch_test(solver):
    """A bar without lateral contraction that is pulled along: its mean strain is that of the force.

    The load pulls at the end's top only, so the strain is averaged over sections away from both ends, where
    bending cancels.
    """
    mesh = bar_mesh(24.0, 2.0, 48, 4, contact=(23.0, 24.0))
    material = with_law(Material(poisson=0.0), solver)
    solution = solver.solve(Problem(mesh, material, Load(displacement=(0.024, None))))
    location = mesh.at_centroids()
    middle = (location.points[:, 0] > 4) & (location.points[:, 0] < 16)
    strain = np.average(solution.state(location).strain[middle], axis=0, weights=mesh.areas[middle])
    expected = solution.reaction[0] / (material.young * 2.0)
    np.testing.assert_allclose(strain, [[expected, 0], [0, 0]], atol=0.03 * expected)


def test_cantilever_against_beam_theory(solver):
    """Tip force of a slender cantilever: Timoshenko's beam with the plane-strain modulus."""
    mesh = bar_mesh(40.0, 4.0, 80, 8, contact=(38.0, 40.0))
    material = with_law(Material(young=10.0, poisson=0.3), solver)
    solution = solver.solve(Problem(mesh, material, Load(displacement=(None, -0.1))))
    modulus = material.young / (1 - material.poisson**2)
    force = -0.1 / beam_compliance(material, modulus, height=4.0, arm=39.0)
    assert solution.reaction[1] == pytest.approx(force, rel=0.01)  # the network is trained briefly
    assert abs(solution.reaction[0]) < 1e-6
