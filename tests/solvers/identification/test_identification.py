"""Contact, walls and law from the markers: twin experiments, deviations, other loads."""

from copy import copy
from dataclasses import replace

import numpy as np
import pytest

from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.quadrature import body_quadrature
from pinnray.geometry.picture_frame import HAND_HELD, Homography, Registration
from pinnray.runtime.errors import UserError
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.fem.identification import FemBody, FemIdSolver
from pinnray.solvers.identification.model import EXACT
from pinnray.solvers.identification.search import Identifier
from pinnray.solvers.identification.unknowns import CORNERS, DEFAULT, PARTS, RESOLVED, Doubt  # type: ignore[attr-defined]
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.solvers.problem import Load
from tests.solvers.conftest import observed_at
from tests.solvers.identification.twins import NOISE, TRUE, contact_of, marked, model_of, sought, twin

FORCE = "position,normal_force,shear_force"


def test_a_twin_is_found_with_its_law(identified):
    """Each within three of its standard deviations, by the law that made it."""
    _, true, solution = identified
    assert solution.status.converged
    assert solution.problem.material.law == "neo-hookean"
    assert solution.stats["inflation"] == 1
    assert solution.status.warnings == []
    for name, value in TRUE.items():
        assert abs(solution.stats[name] - value) < 3 * solution.stats[f"{name}_deviation"]
    force = -true.hypothesis.force[1]
    assert solution.stats["force_low"] < force < solution.stats["force_high"]
    np.testing.assert_allclose(solution.reaction, true.hypothesis.force, rtol=0.1, atol=0.02)


@pytest.mark.slow
def test_markers_that_are_well_known_tell_the_law_that_is_less_expected(problem):
    observed, true = twin(problem, "st-venant-kirchhoff", {"normal_force": 0.24}, noise=1e-3)
    solution = sought(problem, replace(observed, standard_deviations=np.full((9, 2), 1e-3)))
    assert solution.problem.material.law == "st-venant-kirchhoff"
    assert solution.stats["probability st-venant-kirchhoff"] > 0.99
    assert solution.stats["force_low"] < -true.hypothesis.force[1] < solution.stats["force_high"]


@pytest.mark.slow
def test_a_contact_that_wraps_is_told_not_to_be_believed(problem):
    """On a printed finger the force of such a contact was half of the forward one."""
    extent = np.ptp(problem.mesh.points[problem.mesh.boundary("front").ravel(), 0])
    for width, told in ((0.8 * extent, True), (0.2 * extent, False)):
        observed, _ = twin(problem, "neo-hookean", {"normal_force": 0.24, "width": width}, noise=1e-3)
        found = sought(problem, observed, law="given", parameters="position,width,normal_force")
        assert found.stats["width"] == pytest.approx(width, rel=0.1)
        assert any("OF THE FRONT" in said for said in found.status.warnings) == told


@pytest.fixture(scope="module")
def turned(problem):
    """A twin, whose pressed picture is turned by 3 degrees, shifted by 0.3 mm, scaled by 1 % and tilted."""
    observed, true = twin(problem, "st-venant-kirchhoff", TRUE)
    moved = Homography(observed.points.mean(axis=0), np.array([3.0, 0.3, -0.3, 0.01, 0.01, -0.005]))
    shown = moved.moved(observed.points + observed.displacements) - observed.points
    return observed, true, moved, shown


@pytest.mark.parametrize(
    "known", [Registration(3.0, 0.3, 0.01, 0.01), pytest.param(HAND_HELD, marks=pytest.mark.slow)]
)
def test_the_frame_of_the_pressed_picture_is_found(problem, turned, known):
    """The force is as if all were right."""
    observed, true, moved, shown = turned
    found = sought(problem, replace(observed, displacements=shown, pressed=known))
    assert found.status.converged
    for part, value in zip(PARTS, moved.values, strict=True):
        stats = [found.stats[f"pressed_{part}{end}"] for end in ("_low", "", "_high")]
        assert stats[0] < value < stats[2], (part, value, stats)
    force = -true.hypothesis.force[1]
    assert found.stats["force_low"] < force < found.stats["force_high"]
    assert found.stats["force"] == pytest.approx(force, rel=0.1)
    # What it says of the pictures is what they show; the field is the finger's own.
    field = found.displacement_in_space(observed.points)
    np.testing.assert_allclose(found.shown(observed.points, field), shown, atol=4 * NOISE)
    np.testing.assert_allclose(field, observed.displacements, atol=0.6)
    # At the markers the picture is known to their noise, whatever is known of its frame.
    there = problem.mesh.locate(observed.points)
    in_picture, of_finger = found.uncertainty.shown(there), found.uncertainty.displacement(there)
    assert in_picture.max() < 2 * NOISE < of_finger.max()


def test_deviations_are_given_at_points_too(identified):
    """Where a user has places, not triangles of the mesh."""
    field, there = identified[2].field, identified[2].problem.mesh.at_centroids()
    for deviation in (field.standard_deviation, field.shown_deviation, field.von_mises_deviation):
        np.testing.assert_allclose(deviation(there.points[:5]), deviation(there)[:5], rtol=1e-6)


def test_a_finger_with_a_depth_is_in_no_plane_state(identified):
    """Half of the difference of the plane moduli widens force and stress, also where there is no stress."""
    solution = identified[2]
    field, mesh = solution.field, solution.problem.mesh
    share = 0.5 * solution.problem.material.poisson**2
    seen = replace(solution.problem.observations, simulated=False)
    own = replace(field.problem, finger=Design(), observations=seen)
    doubt = Doubt.of(own, weighed=False)
    assert doubt == (share, share, CORNERS)
    # A drawing with roundings has them, and a press on a scale makes up for whatever is wrong.
    assert not Doubt.of(replace(own, finger=Design(fillet_radius=0.3)), weighed=False).corners
    scale = replace(own, observations=replace(seen, weighed=(2.0, 0.1)))
    assert Doubt.of(scale, weighed=False) == RESOLVED

    def deviation(doubt: Doubt) -> np.ndarray:
        model = copy(field.members[0].model)
        model.doubt = doubt
        members = [replace(field.members[0], model=model), *field.members[1:]]
        return replace(field, members=members).von_mises_deviation(there)

    there = mesh.at_centroids()
    stress = solution.state(there).von_mises
    usual = np.sqrt(np.average(stress**2, weights=mesh.areas))
    added = share * np.hypot(stress, usual)
    np.testing.assert_allclose(deviation(doubt), np.hypot(deviation(Doubt(0.0, 0.0)), added), rtol=1e-9)


@pytest.mark.slow
def test_the_force_of_a_finger_with_a_depth_is_known_to_the_difference_of_the_planes(identified, problem):
    observed, forces = identified[0], {}
    for finger in (None, Design()):
        own = replace(problem, finger=finger)
        identifier = Identifier(FemIdSolver(degree=1), own, lambda unknowns: FemBody(unknowns, 1))
        forces[finger is None] = identifier.identify(observed).best.posterior.component(np.array([0.0, -1.0]))
    (size, deviation), plane = forces[False], forces[True]
    assert size == pytest.approx(plane[0])
    told, known = 0.5 * problem.material.poisson**2 * size, RESOLVED.force * size
    assert deviation**2 == pytest.approx(plane[1] ** 2 - known**2 + told**2)


def test_the_field_and_its_deviations_hold_the_truth(identified, problem):
    """Of the body's points, 95 % are asked for; one draw of the noise moves all of them together."""
    _, true, solution = identified
    location = body_quadrature(problem.mesh).location
    # The truth's displacement is where its material is, to first order as the field has it.
    space, member = LagrangeSpace(problem.mesh, 1), solution.field.members[0]
    gradients = np.stack([d @ true.state for d in space.shape_gradients(location)], axis=-1)
    shifts = member.found.walls.shifts(location, true.hypothesis.changes)
    drawn = space.shape_functions(location) @ true.state - np.einsum("nij,nj->ni", gradients, shifts)
    exact = true.motion.moved(location.points + drawn) - location.points
    off = np.abs(exact - solution.displacement_in_space(location))
    deviation = solution.field.standard_deviation(location)
    assert (off < 2 * deviation).mean() > 0.8
    assert 0 < deviation.max() < 0.2


@pytest.mark.slow
def test_the_stress_deviation_is_that_of_refits(problem):
    """Over 12 draws of the noise, the scatter of the von Mises stress is the stated one within its own.

    The law is given, the prior is wide and the model is not doubted: estimates scatter by the noise alone.
    """
    centroids = problem.mesh.at_centroids()
    found, stated = [], []
    refit = FemIdSolver(degree=1, law="given", parameters=FORCE, prior=9.0).refitter(problem)
    for seed in range(12):
        observed, _ = twin(problem, "neo-hookean", {"normal_force": 0.18}, seed=seed)
        solution = refit(observed)
        solution.field.members[0].model.doubt = Doubt(0.0, 0.0)  # type: ignore[attr-defined]
        found.append(solution.state(centroids).von_mises)
        stated.append(solution.field.von_mises_deviation(centroids))  # type: ignore[attr-defined]
    scatter, mean = np.std(found, axis=0, ddof=1), np.mean(stated, axis=0)
    # The scatter of 12 is known to 20 %; an inflated φ of single draws widens the stated one.
    assert 0.7 < np.median(scatter / mean) < 1.3


def test_gradients_of_several_states_are_those_of_their_fields(identified, problem):
    """As a body gives them together, to rounding."""
    location = body_quadrature(problem.mesh).location
    member = identified[2].field.members[0]
    snapshots = [member.found, *member.steps]
    together = member.found.body.gradients(np.array([each.state for each in snapshots]), location)
    for each, found in zip(snapshots, together, strict=True):
        np.testing.assert_allclose(found, each.body.field(each.state).gradient(location), atol=1e-12)


@pytest.mark.slow
def test_a_marker_left_out_in_closed_form_is_nearly_that_of_a_refit(identified, problem):
    observed, _, solution = identified
    refit = FemIdSolver(degree=1).refitter(problem)
    refit(observed)
    for marker in (0, 4, 8):
        again = refit(replace(observed, visible=np.arange(9) != marker))
        there = again.displacement_in_space(problem.mesh.markers[[marker]])[0]
        # The closed form is of first order, and it takes the mean over the marker's disc.
        np.testing.assert_allclose(solution.left_out[marker], there, atol=0.5 * NOISE)


def test_a_weighed_press_finds_young(problem):
    """Twice as stiff under twice the force: the markers are the same, and the scale tells."""
    observed, true = twin(problem, "neo-hookean", {"normal_force": 0.18})
    twice, finger = 2 * true.hypothesis.force[1], Design()
    weighed = replace(observed, weighed=(-finger.depth * twice, -0.01 * finger.depth * twice))
    solution = sought(replace(problem, finger=finger), weighed, law="given", parameters=FORCE)
    # Its prior is a third.
    assert solution.stats["young"] == pytest.approx(2 * 11.4, rel=0.06)
    assert solution.reaction[1] == pytest.approx(twice, rel=0.02)


def test_a_finger_is_carried_to_another_load(identified, problem):
    """At half the travel, the indentation is half of what was found, and the force has its direction."""
    observed, _, solution = identified
    other = replace(problem, load=Load(displacement=(None, -3.0)))
    solver = FemIdSolver(degree=1)
    transferred = solver.transferred(solution, replace(problem, observations=observed), other)
    share = transferred.reaction / solution.reaction
    assert 0.4 < share[0] < 0.6
    assert share[1] == pytest.approx(share[0], rel=1e-5)
    model = solution.field.members[0].model
    forced = model_of(model.unknowns.problem, DEFAULT)
    values = solution.field.members[0].response.values.copy()
    values[forced.unknowns.names.index("normal_force")] = transferred.reaction @ model.unknowns.directions[0]
    values[forced.unknowns.names.index("shear_force")] *= share[0]
    response = forced.response(values, EXACT)
    assert response is not None
    into = model.unknowns.directions[0]
    indentation = contact_of(model, solution.field.members[0].response) @ into
    assert contact_of(forced, response) @ into == pytest.approx(0.5 * indentation, abs=1e-4)


def test_only_an_identified_finger_is_carried_and_only_to_where_it_has_an_equilibrium(identified, problem):
    observed, _, solution = identified
    solver, given = FemIdSolver(degree=1), replace(problem, observations=observed)
    far = replace(problem, load=Load(displacement=(None, -500.0)))
    with pytest.raises(UserError, match="no equilibrium of the identified finger"):
        solver.transferred(solution, given, far)
    found = solution.field.members[0].found
    plain = replace(solution, field=found.body.field(found.state))
    carried = solver.transferred(plain, given, far)
    assert (carried.problem, carried.field) == (far, plain.field)


def test_without_markers_it_is_fem_nonlinear(problem):
    small = replace(problem, load=Load(displacement=(0.0, -1.0)))
    plain = FemIdSolver(degree=1).solve(small)
    np.testing.assert_array_equal(plain.field.values, FemNonlinearSolver(degree=1).solve(small).field.values)  # type: ignore[attr-defined]
    assert plain.solver == "fem-id"


def under(problem, loads):
    """Observations of a finger under several tractions: place, width, force along x and y, N/mm."""
    model = model_of(problem, DEFAULT)
    front, body = model.unknowns.traction, model.body
    rows = [body.displacement_rows(front.points, front.weights(x, width)[:1])[0] for x, width, _, _ in loads]
    total = sum(fx * row[0] + fy * row[1] for row, (_, _, fx, fy) in zip(rows, loads, strict=True))
    state, still = np.zeros(body.shape), np.zeros(len(model.unknowns.motion.names))
    for fraction in np.repeat(np.linspace(0.25, 1.0, 4), 6):
        about = body.linearised(state, problem.material.lame, still)
        assert about is not None
        state = state + about.solve((fraction * total - about.force)[None])[0]
    moved = np.einsum("maxy,xy->ma", marked(model).rows, state)
    moved = moved + NOISE * np.random.default_rng(4).normal(size=moved.shape)
    return observed_at(problem.mesh.markers, moved, NOISE)


@pytest.mark.release
def test_two_contacts_are_said_to_be_something_else(problem):
    """One contact cannot explain two that are 35 mm apart; the interval of their force opens and holds it."""
    solution = sought(problem, under(problem, [(20, 4, 0, -0.15), (55, 4, 0, -0.1)]), law="given")
    assert solution.stats["inflation"] > 3
    assert any("TIMES AS FAR FROM ANY FINGER" in said for said in solution.status.warnings)
    assert solution.stats["force_low"] < 0.25 < solution.stats["force_high"]
    assert solution.stats["force_high"] - solution.stats["force_low"] > 0.05


@pytest.mark.parametrize(
    ("load", "named"),
    [((52, 4, 0.0, -0.15), "far from its drawn place"), ((35, 4, 0.07, -0.15), "with friction")],
)
def test_a_contact_elsewhere_or_with_friction_is_found(problem, load, named):
    solution = sought(problem, under(problem, [load]))
    assert solution.stats["position"] == pytest.approx(load[0], abs=1.5), named
    assert solution.stats["force_low"] < -load[3] < solution.stats["force_high"], named
    np.testing.assert_allclose(solution.reaction, load[2:], atol=0.1 * np.hypot(*load[2:]))
