"""`pinn-std`: its derivatives, its exact output layer, and its distance from finite elements."""

import numpy as np
import pytest
import torch

from geometry.cache import finger_mesh
from geometry.design import Design
from geometry.errors import UserError
from geometry.quadrature import body_quadrature
from solvers.elasticity import Lame, linear_energy_density
from solvers.fem.linear import FemSolver
from solvers.pinn.energy import QuadraticEnergy
from solvers.pinn.gated_units import GatedUnits
from solvers.pinn.standard import PinnStdSolver
from solvers.pinn.trial_space import BaseFactor, NetworkField, TrialUnits
from solvers.problem import Load, Problem


@pytest.fixture
def trial(coarse_mesh) -> TrialUnits:
    rng = np.random.default_rng(0)
    centres = coarse_mesh.points[rng.choice(len(coarse_mesh.points), 40)]
    units = GatedUnits.around(centres, width=3.0, slope=0.3, steepness=2.0, rng=rng)
    return TrialUnits(units, BaseFactor.of(coarse_mesh, 5.0))


def test_derivatives_are_those_of_automatic_differentiation(trial, coarse_mesh):
    points = torch.from_numpy(coarse_mesh.points[::20].copy()).requires_grad_()
    along_x, along_y = trial.derivatives(points.detach())
    values = trial.values_of_piece(points)
    assert torch.equal(trial.values(points.detach()), values.detach())
    for unit in (0, 17, 39):
        (gradient,) = torch.autograd.grad(values[:, unit].sum(), points, retain_graph=True)
        torch.testing.assert_close(gradient[:, 0], along_x[:, unit], rtol=1e-10, atol=1e-12)
        torch.testing.assert_close(gradient[:, 1], along_y[:, unit], rtol=1e-10, atol=1e-12)


def test_gate_is_open_at_its_centre_and_closed_far_away():
    rng = np.random.default_rng(0)
    units = GatedUnits.around(np.zeros((1, 2)), width=2.0, slope=0.3, steepness=2.0, rng=rng)
    angle = np.linspace(0, 2 * np.pi, 50)
    far = torch.from_numpy(np.column_stack([20 * np.cos(angle), 20 * np.sin(angle)]))

    def gate(points):
        hidden = sum(
            units.gate[k] * torch.tanh(points @ units.strips[:2, :, k] + units.strips[2, :, k])
            for k in range(4)
        )
        return torch.tanh(hidden + units.gate[4])

    assert gate(torch.zeros(1, 2, dtype=torch.float64)).item() > 0.9
    assert gate(far).max() < 0


def test_the_quadratic_form_is_the_energy(trial, coarse_mesh):
    """Blocks that grow in two rounds give the integral of the one constitutive law."""
    rule = body_quadrature(coarse_mesh)
    weights = torch.from_numpy(rule.weights.copy())
    points = torch.from_numpy(rule.location.points.copy())
    lame = Lame(35.38, 3.93, 35.38)
    energy = QuadraticEnergy(weights, lame)
    along_x, along_y = trial.derivatives(points)
    for part in (slice(0, 15), slice(15, 40)):
        energy.add(along_x[:, part].clone(), along_y[:, part].clone())
    functionals = trial.values(points[:1])[0]
    best = energy.minimise(functionals, [0, 1], torch.tensor([0.5, -1.0], dtype=torch.float64))
    field = NetworkField(trial, best.output)
    gradient = field.gradient(rule.location)
    np.testing.assert_allclose(gradient, energy.gradient(best.output).numpy(), atol=1e-9)
    integral = (rule.weights * linear_energy_density(gradient, lame)).sum()
    assert best.energy == pytest.approx(integral, rel=1e-9)
    assert best.energy == pytest.approx(
        0.5 * float(best.forces @ torch.tensor([0.5, -1.0]).double()), rel=1e-6
    )
    np.testing.assert_allclose((functionals @ best.output).numpy(), [0.5, -1.0], atol=1e-9)
    # A minimum: moving along a direction that keeps the load's condition costs energy.
    direction = torch.randn(40, 2, dtype=torch.float64, generator=torch.Generator().manual_seed(0))
    direction -= torch.outer(functionals, functionals @ direction) / (functionals @ functionals)
    for sign in (-1, 1):
        moved = energy.gradient(best.output + sign * 1e-3 * direction).numpy()
        assert (rule.weights * linear_energy_density(moved, lame)).sum() > integral


@pytest.mark.slow
def test_displacement_is_within_two_percent_of_finite_elements():
    """The default finger and settings: 1 % is usual; a broken law, load or clamp gives tens of percent."""
    mesh = finger_mesh(Design())
    problem = Problem(mesh)
    network, reference = PinnStdSolver().solve(problem), FemSolver().solve(problem)
    rule = body_quadrature(mesh)
    difference = network.displacement(rule.location) - reference.displacement(rule.location)
    square = (rule.weights[:, None] * difference**2).sum()
    total = (rule.weights[:, None] * reference.displacement(rule.location) ** 2).sum()
    assert np.sqrt(square / total) < 0.02
    assert network.status.converged, network.status.message
    assert network.energy > reference.energy, "fewer unknowns cannot have less energy than the finer space"
    assert np.abs(network.displacement(mesh.markers) - reference.displacement(mesh.markers)).mean() < 0.06


def test_same_seed_same_network_other_seed_other_network(coarse_mesh):
    problem = Problem(coarse_mesh)
    quick = {"units": 100, "rounds": 2}
    first, again, other = (
        PinnStdSolver(**quick, seed=seed).solve(problem).displacement(coarse_mesh.markers)
        for seed in (1, 1, 2)
    )
    np.testing.assert_allclose(first, again, rtol=1e-9)
    assert np.abs(first - other).max() > 1e-3


def test_energy_falls_from_round_to_round(coarse_mesh):
    solution = PinnStdSolver(units=100, rounds=3, tolerance=1e-6).solve(Problem(coarse_mesh))
    assert (np.diff(solution.history["energy"]) < 0).all()
    assert list(solution.history["units"]) == [100, 200, 300]


def test_too_few_units_are_reported_as_not_converged(coarse_mesh):
    solution = PinnStdSolver(units=20, rounds=2).solve(Problem(coarse_mesh))
    assert not solution.status.converged
    assert "take more rounds or more units" in solution.status.message


def test_point_load_of_the_paper_is_met(coarse_mesh):
    solution = PinnStdSolver(units=100, rounds=2).solve(Problem(coarse_mesh, load=Load(kind="point")))
    np.testing.assert_allclose(solution.displacement([[35.0, 0.0]]), [[0.0, -10.0]], atol=1e-8)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"rounds": 1}, "2 rounds"),  # one round cannot be compared with the one before
        ({"units": 0}, "at least 1 unit"),
        ({"seed": -1}, "seed must be zero or more"),  # NumPy's generators refuse it with a traceback
        ({"gate_width": -1.0}, "gate_width must be positive, got -1"),
    ],
)
def test_bad_settings_are_refused(settings, message):
    with pytest.raises(UserError, match=message):
        PinnStdSolver(**settings)
