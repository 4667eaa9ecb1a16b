"""The quantities against closed forms, and against solutions by another way."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.section import rib_pitch
from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.finger_figures import QUANTITIES, break_answer, figures_of
from pinnray.solvers.finger_figures.measures import (
    force_curve,
    largest_away_from_corners,
    narrowest_gap,
    nodal_gradient,
    thinnest_wall,
    wrap_angle,
)
from pinnray.solvers.problem import Load, Material, Problem, Substance
from pinnray.solvers.solution import Estimated, IdentifiedForce, Solution, Status

pytestmark = pytest.mark.usefixtures("few_elements_throughout")

FINGER = Design()
PROBLEM = Problem(finger_mesh(FINGER, settings=MeshSettings(size=1.0), across=1), finger=FINGER)


@dataclass(frozen=True)
class Affine:
    """A displacement that is affine in space."""

    gradient_: FloatArray

    def displacement(self, location: LocatedPoints) -> FloatArray:
        return np.asarray(location.points @ self.gradient_.T)

    def gradient(self, location: LocatedPoints) -> FloatArray:
        return np.broadcast_to(self.gradient_, (len(location), 2, 2)).copy()


def affine(gradient: list[list[float]], problem: Problem = PROBLEM) -> Solution:
    field = Affine(np.array(gradient))
    return Solution("affine", problem, field, 1.0, np.array([0.3, -2.0]), Status(True, "exact"), {})


def test_a_rigid_rotation_wraps_nothing() -> None:
    turned = np.radians(25)
    rotation = np.array([[np.cos(turned), -np.sin(turned)], [np.sin(turned), np.cos(turned)]]) - np.eye(2)
    assert wrap_angle(affine(rotation.tolist())) == pytest.approx(0, abs=1e-9)


def test_wrap_is_positive_where_the_tip_stays_and_the_contact_moves_in() -> None:
    solution = FemSolver(estimate=False).solve(PROBLEM)
    tip = solution.displacement([[FINGER.height, 0.0]])[0]
    (u, v), x = (0.0, -10.0), FINGER.contact_abscissa
    before = np.arctan2(v, x + u)
    beyond = np.arctan2(tip[1] - v, FINGER.height + tip[0] - x - u)
    # The load prescribes a mean over the contact, so that its middle differs a little from (0, -10) mm.
    assert wrap_angle(solution) == pytest.approx(np.degrees(beyond - before), abs=0.3)
    assert wrap_angle(solution) > 0


def test_the_largest_stress_of_a_uniform_strain_is_that_strains() -> None:
    strained = affine([[0.01, 0.0], [0.0, -0.002]])
    stress, strain = (each.value for each in largest_away_from_corners(strained, nodal_gradient(strained)))
    state = strained.state(PROBLEM.mesh.at_centroids())
    assert stress == pytest.approx(state.von_mises[0], rel=1e-12)
    assert strain == pytest.approx(0.01, rel=1e-12)


@pytest.mark.slow
def test_the_largest_stress_depends_little_on_the_mesh() -> None:
    problems = [Problem(finger_mesh(FINGER, settings=MeshSettings(size=size))) for size in (0.5, 0.25)]
    solved = [FemSolver(estimate=False).solve(each) for each in problems]
    found = [largest_away_from_corners(each, nodal_gradient(each))[0] for each in solved]
    # A measured 1 % apart; the largest value at centroids, corners included, doubles.
    assert found[0].value == pytest.approx(found[1].value, rel=0.03)


def test_compliance_across_is_displacement_over_force_of_a_load_that_leaves_u_free() -> None:
    found = figures_of(FemSolver(estimate=False).solve(PROBLEM)).values()
    sliding = FemSolver(estimate=False).solve(replace(PROBLEM, load=Load(displacement=(None, -10.0))))
    force = -sliding.reaction[1] * FINGER.depth
    assert found["compliance_across"] == pytest.approx(10 / force, rel=1e-9)
    along = FemSolver(estimate=False).solve(replace(PROBLEM, load=Load(displacement=(1.0, None))))
    assert found["compliance_along"] == pytest.approx(1 / (along.reaction[0] * FINGER.depth), rel=1e-9)


def test_the_quantities_of_the_default_finger() -> None:
    solution = FemSolver(estimate=False).solve(PROBLEM)
    found = figures_of(solution).values()
    assert list(found) == list(QUANTITIES)
    assert [name for name, each in QUANTITIES.items() if each.always and not np.isfinite(found[name])] == []
    assert found["force"] == pytest.approx(-solution.reaction[1] * FINGER.depth)
    assert found["force_25"] == pytest.approx(found["force"] / 4)
    assert found["area"] == pytest.approx(PROBLEM.mesh.areas.sum(), rel=1e-9)
    assert found["mass"] == pytest.approx(found["area"] * 20 * 1.2e-3)


def test_force_acts_along_the_stroke() -> None:
    oblique = replace(PROBLEM, load=Load(displacement=(3.0, -4.0)))
    (stroke, force) = force_curve(affine([[0, 0], [0, 0]], oblique), FINGER.depth)[-1]
    assert (stroke, force) == pytest.approx((5.0, 20 * (0.18 + 1.6)))


def test_an_identified_force_is_the_force_with_its_interval() -> None:
    found = IdentifiedForce(Estimated(0.3, 0.25, 0.35), Estimated(-0.5, -0.6, -0.4), None)
    figures = figures_of(replace(affine([[0, 0], [0, 0]]), identified=found), rest={})
    for name, value, *ends in (("force", 0.3, 0.25, 0.35), ("tangential_force", -0.5, -0.6, -0.4)):
        assert figures.values()[name] == pytest.approx(value * FINGER.depth)
        assert figures.intervals[name] == pytest.approx([end * FINGER.depth for end in ends])


def test_a_recorded_path_gives_the_force_on_the_way() -> None:
    nonlinear = replace(PROBLEM, material=Material(law="neo-hookean"))
    forces = {"reaction_x": np.zeros(2), "reaction_y": np.array([-0.4, -2.0])}
    history = {"load_fraction": np.array([0.5, 1.0])} | forces
    recorded = replace(affine([[0, 0], [0, 0]], nonlinear), history=history)
    np.testing.assert_allclose(force_curve(recorded, 10.0), [(0, 0), (5, 4), (10, 20)])
    found = figures_of(recorded, rest={})
    depth = FINGER.depth / 10
    forces = found.force_25, found.force_50, found.force_75, found.force
    assert forces == pytest.approx((2 * depth, 4 * depth, 12 * depth, 20 * depth))
    with pytest.warns(UserWarning, match="at 6 mm is interpolated between steps at 5 and 10 mm"):
        assert found.force_at(6.0) == pytest.approx(depth * (4 + 16 / 5))
    assert found.force_at(5.0) == 4 * depth
    with pytest.raises(ValueError, match="known up to the last equilibrium, not at 11 mm"):
        found.force_at(11.0)
    alone = figures_of(affine([[0, 0], [0, 0]], nonlinear), rest={})
    assert np.isnan(alone.force_50)
    with pytest.raises(ValueError, match="known at 10 mm only"):
        alone.force_at(5.0)


def test_walls_and_gaps_of_a_finger_with_known_ones() -> None:
    thin = Design(rib_thickness=1.2, back_thickness=3.0, rib_angle=0.0)
    assert thinnest_wall(thin.section) == pytest.approx(1.2, abs=1e-6)
    tall = Design(base_width=60.0, tip_length=30.0, rib_count=9, rib_angle=0.0)  # ribs are its narrowest gap
    assert narrowest_gap(tall.section) == pytest.approx(rib_pitch(tall) - tall.rib_thickness, abs=1e-6)


def test_mass_and_break_are_of_the_substance() -> None:
    glass = Substance("glass", 2.5, 0.02)
    strained = [[0.01, 0.0], [0.0, -0.002]]
    of_glass = affine(strained, replace(PROBLEM, material=Material().made_of(glass)))
    found = figures_of(of_glass)
    assert found.mass == pytest.approx(2.5e-3 * found.area * FINGER.depth)
    assert figures_of(affine(strained)).mass == pytest.approx(1.2 / 2.5 * found.mass)  # a print's
    assert found.strain_over_break == pytest.approx(0.5)
    assert found.columns()["strain_over_break"] == found.strain_over_break
    assert np.isnan(figures_of(affine(strained)).strain_over_break)
    green = Material(law="neo-hookean").made_of(glass)
    finite = figures_of(affine([[0.01, 0.0], [0.0, 0.0]], replace(PROBLEM, material=green)))
    assert finite.strain_over_break == pytest.approx(0.5)  # the nominal strain, not Green and Lagrange's


@pytest.mark.parametrize(
    ("share", "radius", "said"),
    [
        (np.nan, 0.5, "is not known"),
        (0.4, 0.5, "is 40% of the material's strain at break."),
        (0.6, np.nan, "60% of the material's strain at break: a printed part breaks earlier"),
        (1.2, 0.5, "120% of the material's strain at break: it breaks."),
        (1.2, 0.0, "it breaks; it is at a sharp corner or edge, where it grows with finer elements"),
    ],
)
def test_whether_it_breaks_is_said(share, radius, said) -> None:
    assert said in break_answer(share, radius)


@pytest.mark.parametrize(("fillet", "radius"), [(0.8, 0.8), (0.0, 0.0)])
def test_the_peak_strain_is_at_a_corner_with_its_radius(fillet, radius) -> None:
    """It is larger than that away from corners, and at a sharp one it grows with finer elements."""
    finger = Design(fillet_radius=fillet)
    coarse, fine = (
        figures_of(
            FemSolver(estimate=False).solve(
                Problem(
                    finger_mesh(finger, settings=MeshSettings(size=1.0, corner_size=size)),
                    Material(),
                    Load("cylinder", stroke=5.0).as_mean(),
                    finger=finger,
                )
            ),
            rest={},
        )
        for size in (0.2, 0.1)
    )
    assert coarse.peak_radius == pytest.approx(radius, rel=0.05)
    assert coarse.peak_strain > 1.2 * coarse.principal_strain
    grown = fine.peak_strain / coarse.peak_strain
    assert (grown > 1.15) == (radius == 0)


def test_two_fingers_lift_by_friction() -> None:
    """Of 2 N each and a coefficient of 0.5, 2 N hold 0.204 kg."""
    solution = affine([[0, 0], [0, 0]])
    found = figures_of(solution, rest={})
    assert found.lift == pytest.approx(2 * 0.5 * found.force / 9.81)
    rubbing = replace(PROBLEM, load=Load("cylinder", friction=0.9))
    assert figures_of(affine([[0, 0], [0, 0]], rubbing), rest={}).lift == pytest.approx(1.8 * found.lift)
