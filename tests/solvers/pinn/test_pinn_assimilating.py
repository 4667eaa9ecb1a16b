"""`pinn-asm`, presets `fast` and `local`: the least of energy plus misfit, and what it is without markers."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from pinnray.geometry.mesh.quadrature import body_quadrature
from pinnray.solvers.fem.assimilating import FemAsmSolver
from pinnray.solvers.pinn.finite_basis.newton import find_equilibrium
from pinnray.solvers.pinn.finite_basis.presets import PinnAsmSolver, PinnLocalAsmSolver, PinnStdSolver
from pinnray.solvers.pinn.paper.solver import PaperPinnAsmSolver
from pinnray.solvers.pinn.paper.trained_field import MlpField
from pinnray.solvers.problem import Load, Material, Problem
from tests.solvers.conftest import bar_mesh, hiding, observed_at
from tests.solvers.pinn.autograd_reference import PlainPinn

QUICK = {"wall_spacing": 1.2, "corner_spacing": 0.3, "neurons": 3, "tolerance": 0.05}
FINER = QUICK | {"corner_spacing": 0.15}
"""Within 1 % of finite elements: 0.8 %."""

PINN_ASM = PinnAsmSolver(**QUICK)


def l_curve(solver: PinnAsmSolver, problem: Problem) -> dict[str, np.ndarray]:
    """Energy and misfits for all weights, on one level."""
    level = solver.level(problem, 1.0)
    return solver.curve(level.step(level.zero_output).markers)


def observed(problem: Problem, markers: np.ndarray, displacements: np.ndarray) -> Problem:
    """The problem with displacements that were measured at markers, both (m, 2), mm."""
    deviations = np.linspace(0.01, 0.05, 2 * len(markers)).reshape(-1, 2)
    return replace(problem, observations=observed_at(markers, displacements, deviations))


@pytest.fixture(scope="module")
def plain(marked_mesh):
    return PinnStdSolver(**QUICK).solve(Problem(marked_mesh))


@pytest.fixture(scope="module")
def problem(marked_mesh, plain) -> Problem:
    """Markers that went farther than the model goes, by half a millimetre at the tip."""
    markers = marked_mesh.markers
    farther = [0.2, -0.5] * (markers[:, :1] / 50) ** 2
    return observed(plain.problem, markers, plain.displacement(markers) + farther)


@pytest.fixture(scope="module")
def solution(problem):
    return PINN_ASM.solve(problem)


@pytest.fixture(scope="module")
def bent() -> Problem:
    """A neo-Hookean cantilever that is bent by a quarter of its length, its markers farther than that."""
    mesh = bar_mesh(40.0, 4.0, 40, 4, contact=(38.0, 40.0))
    problem = Problem(mesh, Material(law="neo-hookean"), Load(displacement=(None, -10.0)))
    return observed(problem, np.array([[12.0, -2.0], [24.0, -1.5]]), np.array([[0.3, -2.5], [0.0, -5.5]]))


def functional(solver: PinnAsmSolver, problem: Problem):
    """A level, its misfit, what the markers see of an output layer, and a direction that keeps the load."""
    level, misfit = solver.level(problem, 1.0), solver.misfit(problem)
    points, shares = misfit.sampling()
    where = problem.mesh.locate(points)
    drawn = np.random.default_rng(0).normal(size=level.functionals.shape[1])
    load = level.functionals[: level.load_count]
    drawn -= load.T @ np.linalg.solve(load @ load.T, load @ drawn)
    direction = torch.from_numpy(drawn).view_as(level.zero_output)
    return level, misfit, lambda output: shares @ level.field(output).displacement(where), direction


@pytest.mark.slow
@pytest.mark.parametrize("weights", ["paper", "precision"])
def test_it_has_the_least_energy_plus_misfit(problem, weights):
    """By Taylor's formula: in any direction that keeps the load J rises by its quadratic part, exactly."""
    level, misfit, seen, direction = functional(PinnAsmSolver(**QUICK, weights=weights), problem)

    def total(output: torch.Tensor) -> float:
        return level.energy.total(output) + misfit.value(seen(output))

    least = level.step(level.zero_output)
    quadratic = level.energy.total(direction) + misfit.value(misfit.observed + seen(direction))
    for size in (1.0, 1e-3):
        rise = total(least.output + size * direction) - total(least.output)
        assert rise == pytest.approx(size**2 * quadratic, rel=1e-5)
    assert misfit.value(seen(least.output)) == pytest.approx(level.marker_stats(least)["misfit"], rel=1e-6)
    assert least.forces @ level.targets == pytest.approx(2 * total(least.output), rel=1e-6), "Clapeyron"


def test_finite_strain_has_the_least_energy_plus_misfit_nearby(bent):
    solver = PinnLocalAsmSolver(wall_spacing=0.8, corner_spacing=0.2, neurons=3, asm_weight=0.1)
    solution = solver.solve(bent)
    assert solution.status.converged, solution.status.message
    level, misfit, seen, direction = functional(solver, bent)
    least, _ = find_equilibrium(level, solution.field.output, 1.0)  # type: ignore[attr-defined]
    outputs = [least.output + size * direction for size in (1e-4, 0, -1e-4)]
    ahead, here, behind = (level.energy.total(each) + misfit.value(seen(each)) for each in outputs)
    curvature = ahead - 2 * here + behind
    assert curvature > 0
    assert abs(ahead - behind) < 0.01 * curvature
    assert solution.stats["misfit"] == pytest.approx(level.marker_stats(least)["misfit"], rel=1e-6)


def distances(found, exact, problem: Problem) -> tuple[float, float]:
    """Relative L2 distance of two displacements over the body, and farther than 2 mm from every marker."""
    rule = body_quadrature(problem.mesh)
    ours, theirs = (solution.displacement(rule.location) for solution in (found, exact))
    gap = rule.location.points[:, None] - problem.observations.points
    weights = rule.weights * (np.linalg.norm(gap, axis=2).min(axis=1) > [[0.0], [2.0]])
    return tuple(
        np.sqrt((weights @ ((ours - theirs) ** 2).sum(axis=1)) / (weights @ (theirs**2).sum(axis=1)))
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "given", [{"weights": "paper"}, {"weights": "precision"}, {"marker_radius": 0.0}], ids=str
)
@pytest.mark.parametrize("solver", [PinnAsmSolver, PinnLocalAsmSolver])
def test_it_is_near_the_exact_minimiser_of_finite_elements(problem, plain, solver, given):
    """Within 1 % with few units; the network without the markers is farther away."""
    exact = FemAsmSolver(**given).solve(problem)
    assert max(distances(solver(**FINER, **given).solve(problem), exact, problem)) < 0.01
    assert min(distances(plain, exact, problem)) > 0.02


def test_the_curve_is_that_of_finite_elements(problem):
    """Energy and misfits for all weights that matter, within what the few units cost at the ribs' ends."""
    ours = l_curve(PinnAsmSolver(**FINER), problem)
    exact = FemAsmSolver().solve(problem).history
    assert ours.keys() == exact.keys()
    matter = (ours["weight_factor"] > 1e-8) & (ours["weight_factor"] < 1)
    for name in ours:
        np.testing.assert_allclose(ours[name][matter], exact[name][matter], rtol=0.2, err_msg=name)


@pytest.mark.slow
def test_what_it_says_of_a_marker_that_is_left_out_is_what_it_says_without(problem):
    """In closed form, against a network that was not given that marker; its own weights are those of all."""
    settings = {**QUICK, "weights": "precision", "scale": 1e-4}
    solution, again = (PinnAsmSolver(**settings).solve(each) for each in (problem, hiding(problem, 6)))
    points, shares = PINN_ASM.misfit(hiding(problem, *np.delete(np.arange(9), 6))).sampling()
    np.testing.assert_allclose(solution.left_out[[6]], shares @ again.displacement(points), atol=1e-6)
    assert np.abs(solution.left_out - again.displacement(problem.mesh.markers))[:6].max() > 1e-3


@pytest.mark.parametrize("settings", [None, {"asm_weight": 0.0}, {"weights": "precision", "scale": 0.0}])
def test_without_markers_or_weight_it_is_the_network_without_them(problem, plain, settings):
    given = replace(problem, observations=None) if settings is None else problem
    found = PinnAsmSolver(**QUICK, **(settings or {})).solve(given)
    moved = [each.displacement(problem.mesh.markers) for each in (found, plain)]
    np.testing.assert_allclose(*moved, rtol=1e-9)


def test_neither_order_nor_unseen_markers_matter(problem, solution):
    assert solution.status.converged, solution.status.message
    observations = problem.observations
    order = [3, 0, 4, 8, 1, 2, 4, 7, 6, 5]
    displacements = observations.displacements[order]
    displacements[2] = 1e3
    deviations = observations.standard_deviations[order]
    other = observed_at(observations.points[order], displacements, deviations, np.arange(10) != 2)
    found = PINN_ASM.solve(replace(problem, observations=other))
    points = problem.mesh.points
    np.testing.assert_allclose(found.displacement(points), solution.displacement(points), atol=1e-7)


@pytest.mark.slow
def test_the_first_epochs_of_the_paper_are_those_of_the_plain_implementation(problem):
    tiny = {"width": 8, "layers": 2, "base_points": 20, "precision": "double"}
    solver = PaperPinnAsmSolver(**tiny, epochs=5, asm_weight=100.0)
    history = solver.solve(problem).history
    plain = PlainPinn(problem, solver)
    for epoch in range(5):
        ours = [history[name][epoch] for name in ("PDE", "BC", "ASM", "total")]
        np.testing.assert_allclose(ours, plain.step(), rtol=1e-10)


@pytest.mark.parametrize("settings", [{}, {"marker_radius": 0.8}, {"weights": "precision"}])
def test_the_papers_loss_is_energy_plus_misfit_over_the_area(problem, settings):
    """Without the conditions' penalty; and its gradient is its derivative, by differences of second order."""
    solver = PaperPinnAsmSolver(width=8, layers=2, precision="double", bc_weight=1e-300, **settings)
    loss, parameters = solver.loss(problem), solver.network.initial(0, torch.float64)
    evaluation = loss(parameters)
    misfit = solver.misfit(problem)
    points, shares = misfit.sampling()
    moved = shares @ MlpField(solver.network, parameters).displacement(problem.mesh.locate(points))
    value = misfit.value(moved) / problem.mesh.areas.sum()
    assert float(evaluation.values[-1]) == pytest.approx(float(evaluation.values[0]) + value, rel=1e-10)
    direction = torch.from_numpy(np.random.default_rng(1).normal(size=parameters.shape))
    slope = float((evaluation.gradient * direction).sum())
    rises = [
        float((loss(parameters + size * direction).values - evaluation.values)[-1]) for size in (1e-3, 5e-4)
    ]
    assert (rises[0] - 1e-3 * slope) / (rises[1] - 5e-4 * slope) == pytest.approx(4, rel=0.05)
