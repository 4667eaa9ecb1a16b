"""Contact, walls and law from the markers: equilibria, derivatives, twin experiments, doubtful markers."""

from dataclasses import replace

import numpy as np
import pytest

from geometry.errors import UserError
from geometry.finger.design import Design
from geometry.mesh.boundary import mean_thickness
from geometry.mesh.quadrature import body_quadrature
from geometry.registration import FIXED, HAND_HELD, Registration, Similarity
from solvers.fem.finite_strain.solver import FemNonlinearSolver
from solvers.fem.identification import FemBody, FemIdSolver
from solvers.identification.model import EXACT, MarkerData, MarkerModel, ResponseModel
from solvers.identification.result import Identified
from solvers.identification.search import MOST_LOST, Identifier
from solvers.identification.unknowns import CONTACT, DEFAULT, LAW_ODDS, LAWS, PARTS, Unknowns
from solvers.lagrange import LagrangeSpace
from solvers.problem import Load, Material, Problem
from solvers.solver import NoSolutionError
from tests.solvers.conftest import observed_at

NOISE = 0.01
NAMES = (*DEFAULT, "young")
VALUES = {
    "position": 36.3,
    "width": 5.0,
    "normal_force": 0.16,
    "tangential_force": 0.02,
    "eccentricity": 0.4,
    "front_thickness": 2.1,
    "back_thickness": 1.92,
    "rib_thickness": 2.05,
    "base_thickness": 2.4,
    "base_compliance": 0.5,
    "poisson": 0.43,
    "young": 10.0,
}


@pytest.fixture(scope="module")
def problem(coarse_mesh):
    return Problem(coarse_mesh, Material(law="neo-hookean"), Load(displacement=(None, -6.0)))


def model_of(problem, names=NAMES):
    unknowns = Unknowns(problem, names)
    return ResponseModel(FemBody(unknowns, 1), unknowns)


@pytest.fixture(scope="module")
def model(problem):
    return model_of(problem)


@pytest.fixture(scope="module")
def markers(problem, model):
    return marked(model)


def marked(model):
    """The default finger's markers in a model."""
    observed = observed_at(model.unknowns.problem.mesh.markers, np.zeros((9, 2)), NOISE)
    return MarkerModel(model, MarkerData.of(model.unknowns.problem.mesh, observed, None, None))


def values_of(unknowns, changed=VALUES):
    drawn = {parameter.name: parameter.start for parameter in unknowns.parameters(1.0)}
    return np.array([(drawn | changed)[name] for name in unknowns.names])


def test_a_measurement_of_some_markers_is_the_one_without_the_others(problem):
    """A marker that was dropped as doubtful stays dropped where the fit goes on with other deviations."""
    moved = np.arange(18.0).reshape(9, 2)
    seen = np.arange(9) != 4
    observed = replace(observed_at(problem.mesh.markers, moved, NOISE), visible=seen)
    kept = np.array([0, 2, 3, 6, 7])
    found = MarkerData.of(problem.mesh, observed, None, None).only(kept)
    np.testing.assert_array_equal(found.kept, kept)
    np.testing.assert_array_equal(found.displacements, moved[seen][kept])
    assert found.noise.shape == (10,)


def test_a_last_step_that_turns_a_point_inside_out_is_not_taken(problem, monkeypatch):
    """Its forces are not numbers: once the slopes after it were zero, and a force was found to be 74 % off.

    The state before it is within the tolerance, 0.2 % in the energy norm.
    """
    fresh = model_of(problem)
    values = values_of(fresh.unknowns)
    taken = fresh.response(values)
    again = model_of(problem)
    linearised, slopes, reached = again.body.linearised, again.body.force_slopes, []

    def remembered(state, *rest):
        reached.append(state)
        return linearised(state, *rest)

    def torn(state, *rest):
        found = slopes(state, *rest)
        return found if np.array_equal(state, reached[-1]) else (np.nan * found[0], found[1])

    monkeypatch.setattr(again.body, "linearised", remembered)
    monkeypatch.setattr(again.body, "force_slopes", torn)
    left = again.response(values)
    np.testing.assert_array_equal(left.state, reached[-1])
    size = np.linalg.norm(taken.state)
    assert 0 < np.linalg.norm(left.state - taken.state) < 2e-3 * size
    np.testing.assert_allclose(left.slopes, taken.slopes, atol=2e-3 * np.abs(taken.slopes).max())


def test_a_force_holds_the_finger_where_a_prescribed_displacement_does(problem):
    """`fem-nonlinear` moves the mean of the same contact; its reaction is the force that is given here."""
    moved = FemNonlinearSolver(degree=1).solve(problem)
    model = model_of(problem, DEFAULT)
    left, right = problem.mesh.points[problem.mesh.boundary("contact").ravel(), 0][[0, -1]]
    contact = {"width": abs(right - left), "base_compliance": 1e-9}
    force = {"normal_force": -moved.reaction[1], "tangential_force": moved.reaction[0]}
    response = model.response(values_of(model.unknowns, contact | force), EXACT)
    assert response is not None
    # Gauss points of the two differ in number, which is worth some 1e-4 of a contact two elements wide.
    np.testing.assert_allclose(response.contact, [response.contact[0], -6.0], rtol=2e-3)
    np.testing.assert_allclose(response.state, moved.field.values, atol=2e-3 * 6.0)
    lame = problem.material.lame
    assert model.body.energy(response.state, lame, np.zeros(4)) == pytest.approx(moved.energy, rel=4e-3)


def test_moved_walls_are_a_moved_mesh(problem):
    """The same elements on the nodes that were moved, walls as drawn there: equal to rounding."""
    here = model_of(problem, DEFAULT)
    values = values_of(here.unknowns, VALUES | {"base_compliance": 1e-9})
    response = here.response(values, EXACT)
    assert response is not None
    moved_mesh = replace(problem.mesh, points=here.unknowns.motion.moved(response.hypothesis.changes))
    there = model_of(replace(problem, mesh=moved_mesh), DEFAULT)
    as_drawn = {name: VALUES[name] for name in CONTACT}
    again = there.response(
        values_of(there.unknowns, as_drawn | {"poisson": 0.43, "base_compliance": 1e-9}), EXACT
    )
    assert again is not None
    np.testing.assert_allclose(again.state, response.state, atol=1e-7)
    energies = [
        each.body.energy(found.state, found.hypothesis.lame, found.hypothesis.changes)
        for each, found in ((here, response), (there, again))
    ]
    assert energies[0] == pytest.approx(energies[1], rel=1e-9)


PICTURES = {
    f"{picture}_{part}": value
    for picture, values in (("pressed", (2.0, 0.3, -0.2, 0.01)), ("drawn", (-1.0, 0.1, 0.2, -0.01)))
    for part, value in zip(PARTS, values, strict=True)
}
"""Pictures that are turned, shifted and scaled."""


@pytest.fixture(scope="module")
def unregistered(problem):
    """The model and the markers with pictures whose frames are unknown."""
    observed = observed_at(problem.mesh.markers, np.zeros((9, 2)), NOISE)
    loose = Registration(turn=2.0, shift=0.3, scale=0.01)
    observed = replace(observed, pressed=loose, drawn=loose)
    model = model_of(replace(problem, observations=observed))
    return model, MarkerModel(model, MarkerData.of(problem.mesh, observed, None, None))


@pytest.mark.parametrize("name", [*PICTURES, "normal_force", "base_compliance", "rib_thickness"])
def test_derivatives_by_the_frames_pass_the_taylor_test(unregistered, name):
    check_taylor(*unregistered, name, VALUES | PICTURES)


def test_a_finger_beside_its_drawing_shows_what_lies_where_the_markers_are(problem, unregistered):
    """The drawing is 0.02 mm and 0.02 degrees off; second order in that is left."""
    loose, markers = unregistered
    off = {"drawn_turn": 0.02, "drawn_shift_x": 0.02, "drawn_shift_y": -0.015}
    response = loose.response(values_of(loose.unknowns, VALUES | off), EXACT)
    assert response is not None
    pictures, points = response.hypothesis.pictures, markers.measurement.points
    there = pictures.drawn.moved(points)
    fixed = model_of(problem)
    moved = MarkerModel(fixed, MarkerData.of(problem.mesh, observed_at(there, 0 * there, NOISE), None, None))
    exact = fixed.response(values_of(fixed.unknowns), EXACT)
    assert exact is not None
    shown = pictures.shown(points, moved.predicted(exact)[0].reshape(-1, 2))
    found = markers.predicted(response)[0].reshape(-1, 2)
    np.testing.assert_allclose(found, shown, atol=5e-4)
    start = markers.predicted(loose.response(values_of(loose.unknowns, VALUES), EXACT))[0].reshape(-1, 2)
    assert np.abs(start - shown).max() > 3e-3


@pytest.mark.parametrize("name", NAMES)
def test_derivatives_pass_the_taylor_test(model, markers, name):
    check_taylor(model, markers, name, VALUES)


def check_taylor(model, markers, name, values):
    """What the first-order expansion of the markers leaves falls by four or more when the step is halved.

    It is rounding where the markers are linear in the parameter to six digits.
    """
    unknowns = model.unknowns
    here, which = values_of(unknowns, values), unknowns.names.index(name)
    model.restart(None)
    response = model.response(here, 1e-9)
    assert response is not None
    start, slopes = markers.predicted(response)
    scale = unknowns.parameters(46.0)[which].derivative(0.0)
    scale = min(abs(scale), 0.1 * abs(here[which]))
    left = []
    for step in (0.2 * scale, 0.1 * scale):
        model.restart(response)
        there = model.response(here + step * np.eye(len(here))[which], 1e-9)
        assert there is not None
        left.append(np.linalg.norm(markers.predicted(there)[0] - start - step * slopes[:, which]))
    first = np.linalg.norm(0.2 * scale * slopes[:, which])
    assert first > 0
    if left[0] < 1e-6 * first:
        return
    assert left[0] / left[1] > 3.0  # 2 with a wrong derivative, 8 where the second one is small
    assert left[0] < 0.2 * first


def twin(problem, law, values, *, noise=NOISE, seed=0):
    """Observations of a finger that has such values, and its force, N/mm."""
    own = replace(problem, material=problem.material.model_copy(update={"law": law}))
    model = model_of(own, DEFAULT)
    response = model.response(values_of(model.unknowns, values), EXACT)
    assert response is not None
    moved = marked(model).predicted(response)[0].reshape(-1, 2)
    moved = moved + noise * np.random.default_rng(seed).normal(size=moved.shape)
    return observed_at(problem.mesh.markers, moved, NOISE), response


TRUE = {"position": 37.5, "normal_force": 0.18, "tangential_force": -0.02, "rib_thickness": 2.08}


@pytest.fixture(scope="module")
def identified(problem):
    """A twin of the St Venant-Kirchhoff law, and what is found from its markers with noise."""
    observed, true = twin(problem, "st-venant-kirchhoff", TRUE)
    return observed, true, FemIdSolver(degree=1).solve(replace(problem, observations=observed))


def test_a_twin_is_found_with_its_law(identified):
    """Each within three of its standard deviations, by the law that made it."""
    _, true, solution = identified
    assert solution.status.converged
    assert solution.problem.material.law == "st-venant-kirchhoff"
    assert solution.stats["inflation"] == 1
    for name, value in TRUE.items():
        assert abs(solution.stats[name] - value) < 3 * solution.stats[f"{name}_deviation"]
    size = np.linalg.norm(true.hypothesis.force)
    assert solution.stats["force_low"] < size < solution.stats["force_high"]
    np.testing.assert_allclose(solution.reaction, true.hypothesis.force, rtol=0.1, atol=0.02)


@pytest.mark.parametrize("known", [Registration(turn=3.0, shift=0.3, scale=0.01), HAND_HELD])
def test_the_frame_of_the_pressed_picture_is_found(problem, known):
    """Turned by 3 degrees, shifted by 0.3 mm and scaled by 1 %: the force is as if nothing were wrong."""
    observed, true = twin(problem, "st-venant-kirchhoff", TRUE)
    moved = Similarity(observed.points.mean(axis=0), np.array([3.0, 0.3, -0.3, 0.01]))
    shown = moved.moved(observed.points + observed.displacements) - observed.points
    loose = replace(observed, displacements=shown, pressed=known)
    found = FemIdSolver(degree=1).solve(replace(problem, observations=loose))
    assert found.status.converged
    for part, value in zip(PARTS, moved.values, strict=True):
        stats = [found.stats[f"pressed_{part}{end}"] for end in ("_low", "", "_high")]
        assert stats[0] < value < stats[2], (part, value, stats)
    size = np.linalg.norm(true.hypothesis.force)
    assert found.stats["force_low"] < size < found.stats["force_high"]
    assert found.stats["force"] == pytest.approx(size, rel=0.1)
    # What it says of the pictures is what they show; the field is the finger's own.
    field = found.displacement_in_space(observed.points)
    np.testing.assert_allclose(found.shown(observed.points, field), shown, atol=4 * NOISE)
    np.testing.assert_allclose(field, observed.displacements, atol=0.6)
    # At the markers the picture is known to their noise, whatever is known of its frame.
    there = problem.mesh.locate(observed.points)
    in_picture, of_finger = found.uncertainty.shown(there), found.uncertainty.displacement(there)
    assert in_picture.max() < 2 * NOISE < of_finger.max()
    fixed = FemIdSolver(degree=1).solve(replace(problem, observations=replace(loose, pressed=FIXED)))
    # It has no such picture: the frame is freed, and the result does not count as converged.
    assert not fixed.status.converged
    assert "THE PRESSED PICTURE IS NOT IN THE FRAME OF THAT AT REST" in fixed.status.warnings[0]
    assert fixed.stats["pressed_turn"] == pytest.approx(found.stats["pressed_turn"], abs=0.1)


def test_the_force_is_the_mean_over_the_laws_by_their_odds(identified):
    """Made equally likely by the markers, the laws keep the odds that they had before."""
    observed, _, solution = identified
    problem = replace(solution.problem, observations=None)
    identifier = Identifier(FemIdSolver(degree=1), problem, lambda unknowns: FemBody(unknowns, 1))
    found = identifier.identify(observed)
    by_law = {fit.law: fit for fit in found.fits}
    logs = [by_law[law].log_evidence + np.log(odds) for law, odds in LAW_ODDS.items()]
    share = dict(zip(LAW_ODDS, np.exp(logs - np.logaddexp(*logs)), strict=True))
    np.testing.assert_allclose(found.probabilities, [share[fit.law] for fit in found.fits])
    even = Identified(found.fits, np.array([0.25, 0.75]), {})
    forces, deviations = np.array([fit.force for fit in found.fits]).T
    force = even.force()
    mean = 0.25 * forces[0] + 0.75 * forces[1]
    variance = np.array([0.25, 0.75]) @ (deviations**2 + (forces - mean) ** 2)
    assert force.size.value == pytest.approx(mean)
    assert force.size.high - mean == pytest.approx(1.95996 * np.sqrt(variance), rel=1e-4)
    # The place is where the force acts: the contact's middle plus the eccentricity of the force.
    which = [found.best.model.unknowns.names.index(name) for name in ("position", "eccentricity")]
    places = [float(fit.estimate.values[which].sum()) for fit in found.fits]
    joint = found.best.estimate.slopes[which]
    spread = joint @ found.best.estimate.covariance[np.ix_(which, which)] @ joint
    wall = 0.25 * mean_thickness(problem.mesh)
    assert found.best.place == pytest.approx((places[0], np.hypot(np.sqrt(spread), wall)))
    assert force.position.value == pytest.approx(0.25 * places[0] + 0.75 * places[1])
    assert force.position.low < min(places) < max(places) < force.position.high


def test_a_finger_with_a_depth_is_in_no_plane_state(identified):
    """Half of the difference of the plane moduli widens force and stress, also where there is no stress."""
    solution = identified[2]
    field, mesh = solution.field, solution.problem.mesh
    deep = replace(field, problem=replace(field.problem, finger=Design()))
    there = mesh.at_centroids()
    stress = solution.state(there).von_mises
    usual = np.sqrt(np.average(stress**2, weights=mesh.areas))
    added = 0.5 * solution.problem.material.poisson**2 * np.hypot(stress, usual)
    expected = np.hypot(field.von_mises_deviation(there), added)
    np.testing.assert_allclose(deep.von_mises_deviation(there), expected, rtol=1e-9)


def test_the_force_of_a_finger_with_a_depth_is_known_to_the_difference_of_the_planes(identified, problem):
    observed, forces = identified[0], {}
    for finger in (None, Design()):
        own = replace(problem, finger=finger)
        identifier = Identifier(FemIdSolver(degree=1), own, lambda unknowns: FemBody(unknowns, 1))
        forces[finger is None] = identifier.identify(observed).best.force
    (size, deviation), plane = forces[False], forces[True]
    assert size == pytest.approx(plane[0])
    assert deviation == pytest.approx(np.hypot(plane[1], 0.5 * problem.material.poisson**2 * size))


def test_the_field_and_its_deviations_hold_the_truth(identified, problem):
    """Of the body's points, 95 % are asked for; one draw of the noise moves all of them together."""
    _, true, solution = identified
    location = body_quadrature(problem.mesh).location
    drawn = LagrangeSpace(problem.mesh, 1).shape_functions(location) @ true.state
    walls = WallsOf(true, solution)
    off = np.abs(walls.in_space(location, drawn) - solution.displacement_in_space(location))
    deviation = solution.field.standard_deviation(location)
    assert (off < 2 * deviation).mean() > 0.8
    assert 0 < deviation.max() < 0.2


class WallsOf:
    """The truth's displacement where its material is, to first order as the field has it."""

    def __init__(self, true, solution):
        self._true, self._walls = true, solution.field.members[0].found.walls
        self._space = solution.field.members[0].model.body.space

    def in_space(self, location, drawn):
        gradients = np.stack([d @ self._true.state for d in self._space.shape_gradients(location)], axis=-1)
        shifts = self._walls.shifts(location, self._true.hypothesis.changes)
        return (
            self._true.motion.moved(location.points + drawn - np.einsum("nij,nj->ni", gradients, shifts))
            - location.points
        )


def test_the_stress_deviation_is_that_of_refits(problem):
    """Over 12 draws of the noise, the scatter of the von Mises stress is the stated one within its own.

    The law is given, and the prior is wide, so that estimates scatter by the noise alone.
    """
    centroids = problem.mesh.at_centroids()
    found, stated = [], []
    solver = FemIdSolver(
        degree=1, law="given", parameters="position,normal_force,tangential_force", prior=9.0
    )
    refit = None
    for seed in range(12):
        observed, _ = twin(problem, "neo-hookean", {"normal_force": 0.18}, seed=seed)
        refit = refit or solver.refitter(problem)
        solution = refit(observed)
        found.append(solution.state(centroids).von_mises)
        stated.append(solution.field.von_mises_deviation(centroids))
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
        np.testing.assert_allclose(found, each.drawn.gradient(location), atol=1e-12)


def test_a_marker_left_out_in_closed_form_is_nearly_that_of_a_refit(identified, problem):
    observed, _, solution = identified
    refit = FemIdSolver(degree=1).refitter(problem)
    refit(observed)
    for marker in (0, 4, 8):
        visible = np.ones(9, dtype=bool)
        visible[marker] = False
        again = refit(replace(observed, visible=visible))
        there = again.displacement_in_space(problem.mesh.markers[[marker]])[0]
        # The closed form is of first order, and it takes the mean over the marker's disc.
        np.testing.assert_allclose(solution.left_out[marker], there, atol=0.5 * NOISE)


def test_a_wrong_marker_is_found_and_not_used(identified, problem):
    observed, true, right = identified
    moved = observed.displacements.copy()
    moved[5] += [1.6, -1.2]
    solution = FemIdSolver(degree=1).solve(
        replace(problem, observations=replace(observed, displacements=moved))
    )
    assert "MARKER 6 of those seen CONTRADICTS the others by 2 mm: not used" in solution.status.message
    assert solution.stats["inflation"] == 1
    assert solution.stats["force"] == pytest.approx(right.stats["force"], rel=0.1)
    np.testing.assert_allclose(solution.left_out[5], right.left_out[5], atol=5 * NOISE)
    assert np.linalg.norm(true.hypothesis.force) < solution.stats["force_high"]


def failing(monkeypatch, *laws):
    """Let fits of some laws find no equilibrium."""
    fit = Identifier._fit

    def failed(self, law, *arguments, **options):
        if law in laws:
            raise NoSolutionError(f"no equilibrium of the {law} law")
        return fit(self, law, *arguments, **options)

    monkeypatch.setattr(Identifier, "_fit", failed)


@pytest.mark.parametrize("law", LAWS)
def test_a_law_without_an_equilibrium_is_left_out_and_said(identified, problem, monkeypatch, law):
    failing(monkeypatch, law)
    (other,) = [each for each in LAWS if each != law]
    solution = FemIdSolver(degree=1).solve(replace(problem, observations=identified[0]))
    assert solution.problem.material.law == other
    assert f"no equilibrium of the {law} law was found near the markers" in solution.status.message
    assert f"probability {law}" not in solution.stats


def test_a_law_that_gets_lost_on_the_way_leaves_it_to_the_other(identified, problem, monkeypatch):
    settled = Identifier._settled

    def lost(self, fit):
        if fit.law == "st-venant-kirchhoff":
            raise NoSolutionError("no equilibrium near the markers")
        return settled(self, fit)

    monkeypatch.setattr(Identifier, "_settled", lost)
    solution = FemIdSolver(degree=1).solve(replace(problem, observations=identified[0]))
    assert solution.problem.material.law == "neo-hookean"
    assert "no equilibrium of the st-venant-kirchhoff law" in solution.status.message


def test_without_any_law_it_has_no_solution(identified, problem, monkeypatch):
    failing(monkeypatch, *LAWS)
    with pytest.raises(NoSolutionError, match="no equilibrium of the"):
        FemIdSolver(degree=1).solve(replace(problem, observations=identified[0]))


def test_a_search_ends_where_few_hypotheses_have_an_equilibrium(identified, problem, monkeypatch):
    """Beyond a limit load it would halve its steps for a minute."""
    asked = []

    def response(self, values, *arguments, **options):
        self.evaluations += 1
        asked.append(values)
        return known(self, values, *arguments, **options) if len(asked) < 3 else None

    known = ResponseModel.response
    monkeypatch.setattr(ResponseModel, "response", response)
    with pytest.raises(NoSolutionError, match="see whether the markers are of this finger and load"):
        FemIdSolver(degree=1, law="given").solve(replace(problem, observations=identified[0]))
    assert len(asked) <= 2 + 1 + MOST_LOST


def test_three_hidden_markers_open_the_intervals(identified, problem):
    observed, true, right = identified
    visible = ~np.isin(np.arange(9), (2, 5, 8))
    solution = FemIdSolver(degree=1).solve(replace(problem, observations=replace(observed, visible=visible)))
    widths = [each.stats["force_high"] - each.stats["force_low"] for each in (solution, right)]
    assert widths[0] > widths[1]
    assert solution.stats["force_low"] < np.linalg.norm(true.hypothesis.force) < solution.stats["force_high"]
    assert np.isnan(solution.left_out[[2, 5, 8]]).all()


def test_no_load_is_no_force(problem):
    """Noise alone: the interval of the force holds zero, and nothing is said to be known of the place."""
    noise = NOISE * np.random.default_rng(3).normal(size=(9, 2))
    observed = observed_at(problem.mesh.markers, noise, NOISE)
    solution = FemIdSolver(degree=1).solve(replace(problem, observations=observed))
    assert solution.stats["normal_force_low"] < 0 < solution.stats["normal_force_high"]
    assert solution.stats["force"] < 0.002
    assert "NOT DETERMINED by the markers, but held by its prior: position" in solution.status.message


def test_a_reaction_finds_young(problem):
    """Twice as stiff under twice the force: the markers are the same, and the force tells."""
    observed, true = twin(problem, "neo-hookean", {"normal_force": 0.18})
    twice = 2 * true.hypothesis.force[1]
    names = "position,normal_force,tangential_force,young"
    solver = FemIdSolver(
        degree=1, law="given", parameters=names, reaction=twice, reaction_error=0.01, prior=3.0
    )
    solution = solver.solve(replace(problem, observations=observed))
    assert solution.stats["young"] == pytest.approx(2 * 11.4, rel=0.05)
    assert solution.reaction[1] == pytest.approx(twice, rel=0.02)


def test_a_finger_is_carried_to_another_load(identified, problem):
    """At half the travel, the displacement of the contact is half of what was found."""
    observed, _, solution = identified
    other = replace(problem, load=Load(displacement=(None, -3.0)))
    solver = FemIdSolver(degree=1)
    transferred = solver.transferred(solution, replace(problem, observations=observed), other)
    member = solution.field.members[0]
    values = member.response.values.copy()
    share = np.linalg.norm(transferred.reaction) / np.linalg.norm(solution.reaction)
    assert 0.4 < share < 0.6
    for name in ("normal_force", "tangential_force"):
        values[member.model.unknowns.names.index(name)] *= share
    response = member.model.response(values, EXACT)
    assert response is not None
    into = member.model.unknowns.directions[0]
    assert response.contact @ into == pytest.approx(0.5 * member.response.contact @ into, abs=1e-4)


def test_only_an_identified_finger_is_carried_and_only_to_where_it_has_an_equilibrium(identified, problem):
    observed, _, solution = identified
    solver, given = FemIdSolver(degree=1), replace(problem, observations=observed)
    far = replace(problem, load=Load(displacement=(None, -500.0)))
    with pytest.raises(UserError, match="no equilibrium of the identified finger"):
        solver.transferred(solution, given, far)
    plain = replace(solution, field=solution.field.members[0].found.drawn)
    carried = solver.transferred(plain, given, far)
    assert (carried.problem, carried.field) == (far, plain.field)


def test_without_markers_it_is_fem_nonlinear(problem):
    small = replace(problem, load=Load(displacement=(0.0, -1.0)))
    plain = FemIdSolver(degree=1).solve(small)
    np.testing.assert_array_equal(plain.field.values, FemNonlinearSolver(degree=1).solve(small).field.values)
    assert plain.status.message.startswith("without markers, this is fem-nonlinear: all of the load applied")
    assert plain.solver == "fem-id"


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"parameters": "position,mass"}, "has no parameter 'mass'; it has position, width"),
        ({"parameters": "position"}, "finds a force: give normal_force"),
        ({"parameters": "normal_force,normal_force"}, "'normal_force' is there twice"),
        ({"parameters": "normal_force,young"}, "cannot find young from displacements alone"),
        ({"law": "hooke"}, "law must be evidence or given, got 'hooke'"),
        ({"prior": 0.0}, "prior must be positive"),
        ({"reaction": 0.0}, "a force other than zero"),
        ({"marker_radius": -1.0}, "marker_radius must be zero or more"),
        ({"degree": 3}, "degree 1 and 2, not 3"),
        ({"parameters": " , "}, "finds a force: give normal_force"),
        ({"reaction": -1.0, "reaction_error": np.nan}, "reaction_error must be positive"),
        ({"model": "fem"}, "the linear model is gone; leave out model for finite strain, or take fem-asm"),
        ({"model": "pinn-std"}, "model must be fem-nonlinear, got 'pinn-std'"),
    ],
)
def test_settings_that_make_no_sense_are_refused(settings, said):
    with pytest.raises(UserError, match=said):
        FemIdSolver(**settings)


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
    return replace(problem, observations=observed_at(problem.mesh.markers, moved, NOISE))


def test_two_contacts_are_said_to_be_something_else(problem):
    """One contact cannot explain two that are 35 mm apart; the interval of their force opens and holds it."""
    solution = FemIdSolver(degree=1).solve(under(problem, [(20, 4, 0, -0.15), (55, 4, 0, -0.1)]))
    assert solution.stats["inflation"] > 3
    assert "no values of these parameters explain them" in solution.status.message
    assert solution.stats["force_low"] < 0.25 < solution.stats["force_high"]
    assert solution.stats["force_high"] - solution.stats["force_low"] > 0.05


@pytest.mark.parametrize(
    ("load", "named"),
    [((52, 4, 0.0, -0.15), "far from its drawn place"), ((35, 4, 0.07, -0.15), "with friction")],
)
def test_a_contact_elsewhere_or_with_friction_is_found(problem, load, named):
    solution = FemIdSolver(degree=1).solve(under(problem, [load]))
    assert solution.stats["position"] == pytest.approx(load[0], abs=1.5), named
    size = np.hypot(load[2], load[3])
    assert solution.stats["force_low"] < size < solution.stats["force_high"], named
    np.testing.assert_allclose(solution.reaction, load[2:], atol=0.1 * size)
