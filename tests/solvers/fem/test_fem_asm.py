"""`fem-asm` against a dense minimisation, refits, limits and its own derivative."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.solvers.assimilation.misfit import FACTORS, MarkerSettings
from pinnray.solvers.fem.assimilating import FemAsmSolver
from pinnray.solvers.fem.equilibrium import DiscreteEquilibrium
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.solvers.problem import Load, Problem, contact_functional
from tests.solvers.conftest import hiding, observed_at

LOADS = ("mean", "point", "patch")


def pulled(mesh, load, *, hidden=()):
    """Markers that are 1 mm or so from where `fem` has them, with deviations of every size."""
    random = np.random.default_rng(4)
    problem = Problem(mesh, load=load)
    points = mesh.markers
    visible = np.ones(len(points), dtype=bool)
    visible[list(hidden)] = False
    moved = FemSolver(estimate=False).solve(problem).displacement(points) + random.normal(size=points.shape)
    deviations = random.uniform(0.02, 0.5, points.shape)
    return replace(problem, observations=observed_at(points, moved, deviations, visible))


@pytest.fixture(scope="module", params=LOADS)
def problem(request, marked_mesh):
    return pulled(marked_mesh, Load(kind=request.param), hidden=(3,))


SOFT = FemAsmSolver(weights="precision", scale=0.05)
"""Neither the finger nor the markers have it their own way."""


def dense(problem, solver):
    """The minimiser by Lagrange multipliers on the whole stiffness, without the solver's algebra."""
    space = LagrangeSpace(problem.mesh, solver.degree)
    equilibrium, size = DiscreteEquilibrium(problem, space), space.nodes.size
    matrix = equilibrium.elements.assemble_matrix(equilibrium.tangent, [])
    matrix.convert("dense")
    node_of_dof = np.repeat(equilibrium.elements._node_of_dof, 2) * 2 + np.tile([0, 1], len(space.nodes))
    stiffness = np.zeros((size, size))
    stiffness[np.ix_(node_of_dof, node_of_dof)] = matrix.getDenseArray()
    misfit = MarkerSettings(weights=solver.weights, scale=solver.scale).misfit(problem)
    points, weights = misfit.sampling()
    at = np.kron(weights @ space.shape_functions(problem.mesh.locate(points)).toarray(), np.eye(2))
    conditions, values = [], []

    def hold(rows, axis, to):
        for row in rows:
            conditions.append(np.kron(row, np.eye(2)[axis]))
            values.append(to)

    for axis in (0, 1):
        hold(np.eye(len(space.nodes))[space.boundary_nodes("base")], axis, 0.0)
        to = problem.load.displacement[axis]
        if problem.load.kind == "patch":
            hold(np.eye(len(space.nodes))[space.boundary_nodes("contact")], axis, to)
        else:
            contact, functional = contact_functional(problem)
            row = functional @ space.shape_functions(problem.mesh.locate(contact)).toarray()
            hold([row], axis, to)
    bordered = np.array(conditions)
    diagonal = misfit.weights.ravel()
    held = np.zeros((len(values), len(values)))
    matrix = np.block([[stiffness + at.T * diagonal @ at, bordered.T], [bordered, held]])
    right = np.concatenate([at.T @ (diagonal * misfit.observed.ravel()), values])
    nodal = np.linalg.solve(matrix, right)[:size]
    reaction = (stiffness @ nodal - at.T @ (diagonal * (misfit.observed.ravel() - at @ nodal))).reshape(-1, 2)
    moved = np.setdiff1d(np.arange(len(space.nodes)), space.boundary_nodes("base"))
    return nodal.reshape(-1, 2), 0.5 * nodal @ stiffness @ nodal, reaction[moved].sum(axis=0)


def check_minimiser(solution, problem, solver):
    nodal, energy, reaction = dense(problem, solver)
    assert np.abs(solution.field.values - nodal).max() < 1e-8 * np.abs(nodal).max()
    assert solution.energy == pytest.approx(energy, rel=1e-8)
    np.testing.assert_allclose(solution.reaction, reaction, atol=1e-8 * np.abs(reaction).max())


def check_left_out(solution, problem, solver, marker):
    """The prediction of a marker is its disc's mean displacement when solved again without it."""
    again = solver.solve(hiding(problem, marker))
    disc = MarkerSettings().misfit(
        hiding(problem, *np.delete(np.arange(len(problem.observations.points)), marker))
    )
    points, weights = replace(disc, radius=MarkerSettings().misfit(problem).radius).sampling()
    np.testing.assert_allclose(solution.left_out[[marker]], weights @ again.displacement(points), atol=1e-8)


def test_it_is_the_minimiser_by_dense_algebra(problem):
    solver = replace(SOFT, degree=1)
    check_minimiser(solver.solve(problem), problem, solver)


def test_leaving_a_marker_out_in_closed_form_is_solving_again_without_it(problem):
    """The weights of the others stay: the precision of an observation is its own."""
    solution = SOFT.solve(problem)
    for marker in (0, 4, 8):
        check_left_out(solution, problem, SOFT, marker)
    assert np.isnan(solution.left_out[~problem.observations.visible]).all()


def test_strong_weights_go_through_the_markers(problem):
    observations = problem.observations
    solution = FemAsmSolver(asm_weight=1e9, marker_radius=0.0).solve(problem)
    missed = solution.displacement(observations.points) - observations.displacements
    assert np.abs(missed[observations.visible]).max() < 1e-8
    assert np.abs(missed[~observations.visible]).max() > 0.1


@pytest.mark.parametrize("problem", ["mean"], indirect=True)
def test_the_curve_is_what_other_weights_give(problem):
    curve = SOFT.solve(problem).history
    plain = FemSolver(estimate=False).solve(replace(problem, observations=None))
    for number in (20, 36, 40):
        other = replace(SOFT, scale=SOFT.scale * FACTORS[number]).solve(problem)
        assert other.energy - plain.energy == pytest.approx(curve["curve_energy"][number], rel=1e-6)
        seen = problem.observations.visible
        missed = (other.left_out - problem.observations.displacements)[seen]
        assert np.sqrt((missed**2).mean()) == pytest.approx(curve["curve_left_out_mm"][number], rel=1e-8)
    # Assimilation costs energy, and the more the markers weigh, the more.
    assert (np.diff(curve["curve_energy"]) > 0).all()
    assert (np.diff(curve["curve_in_sample_mm"]) < 0).all()
    chosen = replace(SOFT, choose="left-out").solve(problem)
    assert chosen.stats["weight_factor"] == FACTORS[curve["curve_left_out_mm"].argmin()] != 1


def test_without_markers_it_is_fem(coarse_mesh):
    problem = Problem(coarse_mesh)
    solution = FemAsmSolver().solve(problem)
    assert solution.field.values.tolist() == FemSolver().solve(problem).field.values.tolist()  # type: ignore[attr-defined]
    assert solution.solver == "fem-asm"
    assert solution.left_out is None
