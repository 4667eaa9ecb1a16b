"""The network's body of the inverse problem: its derivatives by differences, its rows by its field."""

import numpy as np
import pytest

from pinnray.geometry.mesh.wall_motion import WallMotion
from pinnray.solvers.elasticity import lame_constants
from pinnray.solvers.pinn.finite_basis.presets import PinnStdSolver
from pinnray.solvers.pinn.identification import network_body
from pinnray.solvers.pinn.identification.network_body import TOLERANCE, NetworkBody
from pinnray.solvers.problem import Material, Problem

COARSE = PinnStdSolver(wall_spacing=1.0, corner_spacing=0.2, neurons=4)
LAME = lame_constants(11.4, 0.4, "strain")
LAWS = ("neo-hookean", "st-venant-kirchhoff")
STEP = 1e-5
"""Of central differences: their error is about 1e-10 of a third derivative, and 1e-11 of rounding."""


@pytest.fixture(scope="module")
def mesh(short_mesh):
    return short_mesh


def slope(function, at, direction, step=STEP):
    """The slope of a function along a direction, by a central difference."""
    return (function(at + step * direction) - function(at - step * direction)) / (2 * step)


@pytest.fixture(scope="module")
def motion(mesh):
    return WallMotion.of(mesh)


def body_of(mesh, motion, law="neo-hookean", scale=1.0) -> NetworkBody:
    return NetworkBody.of(COARSE, Problem(mesh, Material(law=law)), motion, scale)


@pytest.fixture(scope="module", params=LAWS)
def body(request, mesh, motion) -> NetworkBody:
    return body_of(mesh, motion, request.param)


@pytest.fixture(scope="module")
def state(mesh, motion):
    """Near equilibrium of 0.2 N/mm at the last marker, by the neo-Hookean law with walls as drawn."""
    return bent(body_of(mesh, motion), mesh, np.zeros(len(motion.names)))


def pressed(body, mesh):
    """Generalised force of one newton per mm down on the front, shape `body.shape`."""
    return body.displacement_rows(np.array([[mesh.markers[:, 0].max(), 0.0]]), np.array([[-1.0]]))[0, 1]


def bent(body, mesh, changes, force=0.2):
    found = np.zeros(body.shape)
    for _ in range(5):
        linearised = body.linearised(found, LAME, changes)
        found = found + linearised.solve((force * pressed(body, mesh) - linearised.force)[None])[0]
    return found


@pytest.fixture(scope="module")
def changes(motion):
    return 0.1 * np.array([1.0, -1.0, 0.5, 0.8])[: len(motion.names)]


def direction_at(body, state, seed=0):
    return np.random.default_rng(seed).normal(size=body.shape) * np.abs(state).mean()


@pytest.mark.slow
def test_the_force_is_the_slope_of_the_energy(body, state, changes):
    """In a direction as large as the state, to four digits more than its curvature would change it."""
    direction = direction_at(body, state)
    expected = slope(lambda there: body.energy(there, LAME, changes), state, direction)
    force = body.linearised(state, LAME, changes).force
    assert (force * direction).sum() == pytest.approx(expected, rel=1e-5)


@pytest.mark.slow
def test_a_solve_inverts_the_slope_of_the_force(body, mesh, state, changes):
    """The works of what is left are below those of the forces by about the tolerance of a solve."""
    right = np.stack([pressed(body, mesh), body.force_slopes(state, LAME, changes)[1][0]])
    found = body.linearised(state, LAME, changes).solve(right)
    size = np.sqrt((found * right).sum(axis=(1, 2, 3)))
    for one, given, own in zip(found, right, size, strict=True):
        left = slope(lambda there: body.linearised(there, LAME, changes).force, state, one) - given
        np.testing.assert_array_less(np.abs((found * left).sum(axis=(1, 2, 3))), 3e-4 * own * size)


def test_old_factors_lead_to_the_solution_for_a_new_tangent(body, mesh, state, changes):
    """Conjugate gradients from the tangent of other walls end within their tolerance of new factors."""
    right = pressed(body, mesh)[None]
    body.linearised(state, LAME, changes).solve(right)
    before = body.factorisations
    near = body.linearised(1.02 * state, LAME, 0.9 * changes)
    found = near.solve(right)
    assert body.factorisations == before
    exact = body.linearised(1.02 * state, LAME, 0.9 * changes)
    body._factors = None
    expected = exact.solve(right)
    assert body.factorisations == before + 1
    # The work's error is the square of that in the energy norm.
    assert (found * right).sum() == pytest.approx((expected * right).sum(), rel=TOLERANCE**2)


@pytest.mark.slow
def test_factors_from_far_away_are_replaced(body, mesh, state, changes):
    right = pressed(body, mesh)[None]
    body.linearised(0 * state, LAME, changes).solve(right)
    before = body.factorisations
    body.linearised(state, LAME, changes).solve(right)
    assert body.factorisations == before + 1


@pytest.mark.parametrize(
    ("stiffer", "new", "falling"), [(0.8, 0, False), (0.4, 1, False), (-1.0, 1, True)], ids=str
)
def test_factors_of_a_tangent_nearby_tell_of_stability(body, mesh, state, changes, stiffer, new, falling):
    """Where the tangent has changed by less than half; with moduli below zero the energy falls everywhere."""
    body.linearised(state, LAME, changes).solve(pressed(body, mesh)[None])
    before = body.factorisations
    lame = LAME._replace(λ=stiffer * LAME.λ, μ=stiffer * LAME.μ)
    negative = body.linearised(state, lame, changes).negative()
    assert body.factorisations == before + new
    assert negative == (state.size if falling else 0)


def test_slopes_by_walls_and_moduli_are_those_of_differences(body, state, changes):
    walls, moduli, _ = body.force_slopes(state, LAME, changes)
    for found, one in zip(walls, np.eye(len(changes)), strict=True):
        expected = slope(lambda moved: body.linearised(state, LAME, moved).force, changes, one)
        np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())
    constants = np.array(LAME)
    for found, one in zip(moduli, np.diag(constants)[:2], strict=True):
        expected = slope(
            lambda lame: body.linearised(state, LAME._make(lame), changes).force,  # type: ignore[call-arg]
            constants,
            one,
            1e-4,
        )
        np.testing.assert_allclose(found * one.sum(), expected, atol=1e-6 * np.abs(expected).max())


def test_rows_give_sums_of_displacements_and_gradients(body, mesh, state):
    location = mesh.locate(mesh.markers)
    rng = np.random.default_rng(0)
    weights = rng.normal(size=(3, len(location.points), 2))
    field = body.field(state)
    found = np.tensordot(body.displacement_rows(location.points, weights[..., 0]), state, axes=3)
    np.testing.assert_allclose(found, weights[..., 0] @ field.displacement(location), rtol=1e-9)
    found = np.tensordot(body.gradient_rows(location.points, weights), state, axes=3)
    np.testing.assert_allclose(found, np.einsum("rqj,qaj->ra", weights, field.gradient(location)), rtol=1e-9)


def test_a_stretched_body_without_moved_material_has_the_energy_of_its_own_gradient(
    body, mesh, motion, state
):
    """With the motion W = 0.1 (X, 0) of an invented wall, G = H diag(1 / 1.1, 1) and 1.1 of the volume."""
    count = len(body._energy.weights)
    stretch = np.zeros((1, count, 2, 2))
    stretch[..., 0, 0] = 1.0
    moved = NetworkBody(body._energy, stretch)
    gradient = body._energy.gradients(network_body.torch.from_numpy(state)[None])[0].clone()  # type: ignore[attr-defined]
    gradient[:, :, 0] /= 1.1
    density = network_body.energy_density(gradient, LAME, body._law)  # type: ignore[attr-defined]
    expected = 1.1 * float(body._energy.weights @ density)
    assert moved.energy(state, LAME, np.array([0.1])) == pytest.approx(expected, rel=1e-12)


def test_walls_that_overlap_are_inside_out(body, state, changes):
    assert body.linearised(state, LAME, 100 + 0 * changes) is None
    assert body.linearised(-1e3 * state, LAME, changes) is None


@pytest.mark.slow
def test_a_state_is_carried_to_a_finer_network(mesh, motion, state):
    """The finer network's functions include nothing of the coarser's; both are within 2 % of each other."""
    coarse, fine = body_of(mesh, motion), body_of(mesh, motion, scale=0.8)
    changes = np.zeros(len(motion.names))
    states = np.array([state, -0.5 * state])
    found, half = fine.projected(coarse.gradients(states, mesh.locate(fine.points)), LAME, changes)
    np.testing.assert_allclose(half, -0.5 * found, atol=1e-9 * np.abs(found).max())
    there = mesh.at_nodes()
    expected = coarse.field(state).displacement(there)
    error = np.linalg.norm(fine.field(found).displacement(there) - expected)
    assert error < 0.02 * np.linalg.norm(expected)


def test_gradients_of_a_body_turned_inside_out_are_carried_as_well(mesh, motion, state):
    """Elements may be turned inside out between their points of quadrature: the norm is another one there."""
    body, changes = body_of(mesh, motion), np.zeros(len(motion.names))
    gradients = body.gradients(state[None], mesh.locate(body.points))
    gradients[0, :5] = [[-2.0, 0.0], [0.0, 0.0]]
    assert np.isfinite(body.projected(gradients, LAME, changes)).all()


def test_gradients_of_several_states_are_those_of_their_fields(body, mesh, state):
    """As the body gives them together, to rounding."""
    location = mesh.locate(mesh.markers)
    states = np.array([state, -0.5 * state])
    for one, found in zip(states, body.gradients(states, location), strict=True):
        np.testing.assert_allclose(found, body.field(one).gradient(location), atol=1e-12)


def test_what_is_no_number_is_not_solved_by_zero(body, mesh, state, motion):
    """With the factors of another tangent at hand, by conjugate gradients."""
    linearised = body.linearised(state, LAME, np.zeros(len(motion.names)))
    right = np.stack([pressed(body, mesh), np.full(body.shape, np.nan)])
    linearised.solve(right[:1])
    assert np.isnan(linearised.solve(right)).any()
