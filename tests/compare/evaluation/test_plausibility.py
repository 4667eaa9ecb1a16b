"""Measurements that cannot be, or hardly, of the finger under its load; units mm."""

import re
from dataclasses import replace

import numpy as np
import pytest

from pinnray.comparison.evaluation.plausibility import check_positions, displacement_remarks, problem_remarks
from pinnray.comparison.evaluation.virtual_experiment import virtual_experiment
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.observations import Observations
from pinnray.solvers.problem import Load, Material, Problem


@pytest.fixture(scope="module")
def problem(coarse_mesh: TriangleMesh) -> Problem:
    return Problem(coarse_mesh, Material(), Load())


@pytest.fixture(scope="module")
def measured(problem: Problem) -> Observations:
    """Displacements of finite strain, as unlike those of linear `fem` as a real finger's may be."""
    return virtual_experiment(problem, 0.8)[0]


@pytest.mark.parametrize(
    ("load", "young", "said"),
    [
        ({"displacement": (0.0, -0.01)}, 11.4, "the stroke of 0.01 mm is .*; this looks like metres"),
        ({"kind": "cylinder", "radius": 0.005}, 11.4, "the radius of 0.005 mm is .*; this looks like metres"),
        ({}, 1e6, "modulus of 1e[+]06 MPa .*; this looks like pascals, give MPa"),  # a silicone of 1 MPa
        ({}, 0.0114, "modulus of 0.0114 MPa .*; this looks like gigapascals, give MPa"),
    ],
)
def test_a_load_or_a_material_in_other_units_is_warned_of(load, young, said, coarse_mesh):
    (remark,) = problem_remarks(Problem(coarse_mesh, Material(young=young), Load(**load)))
    assert re.search(said, remark)


@pytest.mark.parametrize(
    ("load", "young"),
    [
        ({}, 11.4),
        ({"displacement": (None, -0.5)}, 0.05),  # the softest silicone, pressed a little
        ({"kind": "cylinder", "displacement": (0.0, -30.0), "radius": 2.0}, 3500.0),  # a hard plastic
    ],
)
def test_a_usual_load_and_material_are_not_warned_of(load, young, coarse_mesh):
    assert problem_remarks(Problem(coarse_mesh, Material(young=young), Load(**load))) == []


@pytest.mark.parametrize("scale", [0.5, 1.0, 2.0])  # another stiffness of walls, another place of the contact
def test_what_may_be_a_real_finger_is_not_warned_of(measured, problem, scale):
    check_positions(measured, problem.mesh)
    other = replace(measured, displacements=scale * measured.displacements)
    assert displacement_remarks(other, problem) == []


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda moved: moved / 10, "times those of fem for a stroke of 10 mm; check unit and stroke"),
        (lambda moved: np.vstack([[0, -60], moved[1:]]), "marker 1 moved by 60 mm, 3 times farther than any"),
        (lambda moved: 0 * moved, "no marker moved"),
        (lambda moved: moved * (-1) ** np.arange(9)[:, None], "unlike those of fem (cosine"),  # no pattern
    ],
)
def test_unlikely_displacements_are_warned_of(measured, problem, change, said):
    (remark, *_) = displacement_remarks(
        replace(measured, displacements=change(measured.displacements)), problem
    )
    assert said in remark


@pytest.mark.parametrize(
    ("places", "seen", "said"),
    [
        (np.arange(9), 1, "one marker was seen: the measurements say what happens at one place"),
        (np.full(9, 4), 9, "all 9 markers seen lie within 0.08 mm: the measurements say what happens at one"),
        (np.arange(9), 2, None),  # two places
    ],
)
def test_markers_at_one_place_are_warned_of(places, seen, said, measured, problem):
    points = measured.points[places] + np.outer(0.01 * np.arange(9), [float(places[0] == 4), 0.0])
    moved, last = measured.displacements[places], np.arange(9) >= 9 - seen
    changed = replace(measured, points=points, displacements=moved, visible=last)
    remarks = displacement_remarks(changed, problem)
    assert [said in remark for remark in remarks] == [True] if said else remarks == []


def test_a_reversed_u_is_warned_of_at_a_small_stroke(measured, problem):
    """At a large one u of linear `fem` says nothing of its sign."""
    small = replace(problem, load=Load(displacement=(0, -2)))
    moved = virtual_experiment(small, 0.8)[0].displacements
    (remark,) = displacement_remarks(replace(measured, displacements=moved * [-1, 1]), small)
    assert "u goes against that of fem" in remark


def test_a_finger_that_is_pressed_far_is_not_warned_of(measured, problem):
    """A cylinder of radius 15 mm by 22 mm at x = 45 mm by `fem-nonlinear`: u goes against that of `fem`."""
    moved = np.array(
        [
            (-0.79, -5.35),
            (-4.43, -5.11),
            (-3.41, -13.64),
            (-5.35, -14.23),
            (-5.11, -20.42),
            (-4.97, -20.30),
            (-5.29, -21.89),
            (-4.70, -21.70),
            (-5.31, -20.24),
        ]
    )
    far = replace(problem, load=Load(displacement=(None, -22.0), position=45.0))
    assert displacement_remarks(replace(measured, displacements=moved), far) == []


def test_markers_that_hardly_move_in_fem_say_nothing_of_directions(measured, problem):
    only = np.arange(len(measured.points)) == 0
    reversed_ = replace(measured, displacements=-measured.displacements, visible=only)
    beside_base = replace(reversed_, points=np.vstack([[2.0, -1.0], measured.points[1:]]))
    (remark,) = displacement_remarks(beside_base, problem)
    assert remark.startswith("one marker was seen")


def test_another_order_of_the_markers_is_warned_of(measured, problem):
    """Reversed, numbered one off, and two walls swapped; a factor makes no other order likely."""
    count = len(measured.points)
    swapped = np.arange(count).reshape(-1, 3)[:, [1, 0, 2]].ravel()
    for order in (np.arange(count)[::-1], np.roll(np.arange(count), 1), swapped):
        mixed = replace(measured, displacements=measured.displacements[order])
        remarks = displacement_remarks(mixed, problem)
        assert any("see how they are numbered" in remark for remark in remarks), order
    smaller = replace(measured, displacements=0.5 * measured.displacements)
    assert displacement_remarks(smaller, problem) == []


def test_two_markers_whose_clicks_were_exchanged_are_named(measured, problem):
    places = measured.points + measured.displacements
    places[[3, 5]] = places[[5, 3]]
    mixed = replace(measured, displacements=places - measured.points)
    remarks = displacement_remarks(mixed, problem)
    said = "pressed places look mixed up: much likelier they are with 4 and 6 exchanged"
    assert any(said in remark for remark in remarks)
