"""Points clicked in two photographs: scale, mirror image, order and noise are found, bad lists refused."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.validation.printed_finger import FINGERS
from pinnray.geometry.picture_frame import HAND_HELD
from pinnray.runtime.errors import UserError
from pinnray.vision.clicked_points import Clicks, clicked_points, read_clicks

MARKERS = np.array(
    [[10.0, -1], [20, -1], [30, -1], [40, -1], [50, -1], [45, -8], [35, -14], [25, -20], [12, -29]]
)
MOVED = np.column_stack([-0.02 * MARKERS[:, 0], -0.1 * MARKERS[:, 0]])


def picture(places, scale, *, turn=25.0, order=slice(None), flip=True):
    """Clicks on places, mm, in pixels with y down."""
    angle = np.radians(turn)
    rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    pixels = (places @ rotation.T / scale + [800, 300]) * [1, -1 if flip else 1]
    return Clicks(pixels[order], None)


def found(rest, pressed, **settings):
    return clicked_points(rest, pressed, MARKERS, marker_radius=0.5, source="clicks", **settings)


@pytest.mark.parametrize(("flip", "given"), [(True, {}), (False, {"scale": (0.2, 0.2)})])
def test_pictures_of_one_camera_give_the_displacements(flip, given):
    result = found(picture(MARKERS, 0.2, flip=flip), picture(MARKERS + MOVED, 0.2, flip=flip), **given)
    assert result.mirrored == flip
    assert result.scales == pytest.approx((0.2, 0.2))
    np.testing.assert_allclose(result.observations.displacements, MOVED, atol=1e-9)
    assert result.observations.pressed == HAND_HELD
    assert not result.observations.simulated


def test_each_picture_has_the_scale_of_the_lengths_along_the_walls():
    turned = MARKERS @ np.array([[0.99, 0.14], [-0.14, 0.99]]) / np.hypot(0.99, 0.14)
    result = found(picture(MARKERS, 0.2), picture(turned, 0.25), scale="lengths")
    assert result.scales == pytest.approx((0.2, 0.25))
    order = np.array([3, 0, 1, 2, 4, 5, 6, 8, 7])  # lines are between clicks, not between markers
    bent = MARKERS + np.outer(np.arange(9) > 4, [0.0, 3.0])
    rest, pressed = picture(MARKERS, 0.2, order=order), picture(bent, 0.25, order=order)
    own, moved = (np.linalg.norm(np.diff(each[order], axis=0), axis=1).sum() for each in (MARKERS, bent))
    assert found(rest, pressed, scale="lengths").scales == pytest.approx((0.2, 0.25 * own / moved))
    shift = result.observations.displacements - (turned - MARKERS)
    np.testing.assert_allclose(shift, np.broadcast_to(shift[0], shift.shape), atol=1e-9)  # of the origin


def test_points_in_another_order_get_the_nearest_markers():
    order = np.random.default_rng(3).permutation(len(MARKERS))
    result = found(picture(MARKERS, 0.2, order=order), picture(MARKERS + MOVED, 0.2, order=order))
    np.testing.assert_allclose(result.observations.displacements, MOVED, atol=1e-9)


def test_noise_is_the_misfit_at_rest():
    rng = np.random.default_rng(5)
    noises = []
    for _ in range(40):
        rest, pressed = (
            picture(each + rng.normal(0, 0.3, MARKERS.shape), 0.2) for each in (MARKERS, MARKERS)
        )
        result = found(rest, pressed)
        noises.append(result.noise)
        assert result.observations.standard_deviations == pytest.approx(np.sqrt(2) * result.noise)
    # The standard deviation of 0.3 from 14 degrees of freedom, a mean of 40: 0.009.
    assert np.sqrt(np.mean(np.square(noises))) == pytest.approx(0.3, abs=0.03)


def test_noise_of_repeats(tmp_path):
    rng = np.random.default_rng(6)
    places = picture(MARKERS, 0.2).places
    lines = ["# ImageJ", "x,y,point"]
    for repeat in range(4):
        del repeat
        for number, place in enumerate(places + rng.normal(0, 1.5, places.shape)):
            lines.append(f"{place[0]},{place[1]},{number}")
    path = tmp_path / "rest.csv"
    path.write_text("\n".join(lines))
    clicks = read_clicks(path)
    assert len(clicks.places) == len(MARKERS)
    assert clicks.noise == pytest.approx(1.5 / 2, rel=0.25)  # a mean of four
    pressed = Clicks(picture(MARKERS + MOVED, 0.2).places, None, tuple(range(9)))
    assert found(clicks, pressed).reason == "the repeats"


def test_numbered_points_are_those_of_their_number(tmp_path):
    """Clicked in another order in the second picture."""
    lists = []
    for places, order in ((MARKERS, range(9)), (MARKERS + MOVED, [4, 2, 8, 0, 1, 3, 7, 6, 5])):
        pixels = picture(places, 0.2).places
        rows = [f"{pixels[number, 0]},{pixels[number, 1]},{number}" for number in order]
        path = tmp_path / "clicks.csv"
        path.write_text("\n".join(["x,y,point", *rows]))
        lists.append(read_clicks(path))
    np.testing.assert_allclose(found(*lists).observations.displacements, MOVED, atol=1e-9)
    with pytest.raises(UserError, match="of one picture are numbered, those of the other are not"):
        found(lists[0], picture(MARKERS, 0.2))


def swapped(one: int, other: int) -> np.ndarray:
    order = np.arange(9)
    order[[one, other]] = order[[other, one]]
    return order


@pytest.mark.parametrize("numbered", [False, True])
@pytest.mark.parametrize("scale", ["same", "lengths", (0.2, 0.2)])
@pytest.mark.parametrize(
    ("order", "said"),
    [
        (swapped(6, 7), "with 7 and 8 exchanged"),
        (swapped(0, 8), "with 1 and 9 exchanged"),
        (np.arange(9)[::-1], "in reverse"),
        (np.roll(np.arange(9), 2), "in the order 3 4 5 6 7 8 9 1 2"),
        (np.random.default_rng(3).permutation(9), "in the order"),
    ],
)
def test_a_pressed_list_in_another_order_is_told_and_put_right_unless_it_is_numbered(
    order, said, scale, numbered
):
    numbers = tuple(range(1, 10)) if numbered else ()
    rest, pressed = picture(MARKERS, 0.2), picture(MARKERS + MOVED, 0.2, order=order)
    result = found(*(Clicks(each.places, None, numbers) for each in (rest, pressed)), scale=scale)
    (remark,) = result.remarks
    assert said in remark
    right = MOVED if not numbered else (MARKERS + MOVED)[order] - MARKERS
    if scale != "lengths":  # whose scale is that of the lines between the points
        np.testing.assert_allclose(result.observations.displacements, right, atol=1e-9)


@pytest.mark.parametrize("shown", [MOVED, 3 * MOVED, 0 * MOVED + [0.3, -5.0], MOVED + np.array([4.0, 9.0])])
def test_a_right_list_is_left_as_it_is(shown):
    noise = np.random.default_rng(4).normal(0, 0.3, MARKERS.shape)
    result = found(picture(MARKERS, 0.2), picture(MARKERS + shown + noise, 0.2))
    assert result.remarks == ()
    np.testing.assert_allclose(result.observations.displacements, shown + noise, atol=1e-9)


@pytest.mark.parametrize(
    ("pressed", "said"),
    [
        (picture(MARKERS, 0.2), "both lists have the same points"),
        (picture(MARKERS, 0.2, order=slice(None, None, -1)), "both lists have the same points"),
        (picture(MARKERS + MOVED, 0.2, flip=False), "y runs the other way in the pressed list"),
        (picture(0 * MARKERS, 0.2), "all points of a picture are at one place"),
        (picture(MARKERS + MOVED, 2.0), " times closer together"),
        (picture(MARKERS + MOVED, 0.02), " times farther apart"),
        (picture(MARKERS + MOVED, 0.2 / 1.5), " times farther apart"),
        (
            picture(MARKERS + MOVED, 0.2, order=[0, 0, *range(2, 9)]),
            "two points of one picture are at one place",
        ),
    ],
)
def test_a_pressed_list_of_another_kind_is_refused(pressed, said):
    with pytest.raises(UserError) as caught:
        found(picture(MARKERS, 0.2), pressed)
    assert said in str(caught.value)


@pytest.mark.parametrize("numbered", [False, True])
@pytest.mark.parametrize("blank", [False, True])
@pytest.mark.parametrize("where", ["at rest", "in the pressed picture"])
def test_a_point_that_is_missing_in_one_picture_is_left_out_and_named(where, blank, numbered):
    lists = []
    for name, places in (("at rest", MARKERS), ("in the pressed picture", MARKERS + MOVED)):
        pixels, numbers = picture(places, 0.2).places, np.arange(1, 10)
        if name == where:
            kept = numbers != 4
            pixels = np.where(kept[:, None], pixels, np.nan) if blank and not numbered else pixels[kept]
            numbers = numbers[kept]
        lists.append(Clicks(pixels, None, tuple(numbers.tolist()) if numbered else ()))
    result = found(*lists)
    assert f"left out, as missing {where}: point 4" in result.remarks
    assert result.observations.visible.tolist() == [n != 3 for n in range(9)]
    seen = result.observations.visible
    np.testing.assert_allclose(result.observations.displacements[seen], MOVED[seen], atol=1e-9)


def test_lists_that_lack_different_points_are_refused_unless_they_are_numbered():
    numbers, lists = np.arange(1, 10), []
    for places, missing in ((MARKERS, 3), (MARKERS + MOVED, 7)):
        kept = numbers != missing
        lists.append(Clicks(picture(places, 0.2).places[kept], None, tuple(numbers[kept].tolist())))
    result = found(*lists)
    assert result.observations.visible.tolist() == [n not in (3, 7) for n in numbers]
    with pytest.raises(UserError, match="number them in a column point"):
        found(*(Clicks(each.places, None) for each in lists))


@pytest.mark.parametrize("missing", [None, 4])
def test_numbers_of_one_list_that_are_shifted_are_refused(missing):
    kept = np.arange(9) != missing
    pressed = Clicks(picture(MARKERS + MOVED, 0.2).places[kept], None, tuple(range(missing is not None, 9)))
    with pytest.raises(UserError, match="look shifted"):
        found(Clicks(picture(MARKERS, 0.2).places, None, tuple(range(1, 10))), pressed)


@pytest.mark.parametrize("change", [lambda p: p * [-1, 1] + [1700, 0], lambda p: p + 300])
def test_a_picture_that_is_cut_or_mirrored_is_told(change):
    pressed = Clicks(change(picture(MARKERS + MOVED, 0.2, turn=0).places), None)
    remarks = found(picture(MARKERS, 0.2, turn=0), pressed).remarks
    assert "of the points' extent: is a picture cut" in " ".join(remarks)


def test_a_point_that_is_missing_from_one_line_leaves_the_markers_of_the_full_list():
    """Without it the points at rest and their mirror image fit alike."""
    markers = np.array([[10.0, -1], [20, -1], [30, -1], [40, -1], [50, -9]])[[4, 0, 1, 2, 3]]
    rest, pressed = (Clicks(each[::-1], None) for each in (markers, markers - np.array([0.0, 2.0])))
    lost = Clicks(np.where(np.arange(5)[:, None] == 4, np.nan, pressed.places), None)
    result = clicked_points(rest, lost, markers, marker_radius=0.5, source="clicks")
    assert result.observations.visible.tolist() == [False, True, True, True, True]


def test_lists_that_are_exchanged_are_told():
    (remark,) = found(picture(MARKERS + MOVED, 0.2), picture(MARKERS, 0.2)).remarks
    assert "nearer to the drawing than those at rest: exchanged?" in remark


def test_a_row_without_numbers_is_a_missing_point_and_german_excel_is_read(tmp_path):
    path = tmp_path / "clicks.csv"
    path.write_text("\ufeffx;y\n1,5;2\nnan;nan\n3;4,25\n5;6\n", encoding="utf-8")
    np.testing.assert_array_equal(read_clicks(path).places, [[1.5, 2], [np.nan] * 2, [3, 4.25], [5, 6]])


TRACKPY = "frame,particle,x,y,mass\n" + "\n".join(
    f"{frame},{point},{10 * x + 5 * (frame > 1)},{-10 * y},1"
    for frame in range(4)
    for point, (x, y) in enumerate(MARKERS)
)
DEEPLABCUT = (
    "scorer"
    + ",net" * 27
    + "\nbodyparts"
    + "".join(f",m{n},m{n},m{n}" for n in range(9))
    + "\ncoords"
    + ",x,y,likelihood" * 9
    + "\n"
    + "\n".join(
        f"{frame}" + "".join(f",{10 * x + 5 * (frame > 1)},{-10 * y},0.99" for x, y in MARKERS)
        for frame in range(4)
    )
)


@pytest.mark.parametrize(("program", "content"), [("trackpy", TRACKPY), ("deeplabcut", DEEPLABCUT)])
def test_the_page_makes_clicks_of_an_export(tmp_path, monkeypatch, program, content):
    page = (Path(__file__).parents[2] / "docs" / "how-to" / "measurements.md").read_text(encoding="utf-8")
    names: dict = {}
    exec(page.split("```python\n")[1].split("```")[0], names)
    monkeypatch.chdir(tmp_path)
    Path("tracks.csv").write_text(content, encoding="utf-8")
    names["write_means"](names[program]("tracks.csv"), (0, 1), (2, 3))
    result = found(read_clicks(Path("rest.csv")), read_clicks(Path("pressed.csv")))
    assert result.mirrored
    np.testing.assert_allclose(result.observations.displacements, np.full((9, 2), (0.5, 0)), atol=1e-9)


@pytest.mark.parametrize("finger", FINGERS)
def test_another_scale_and_a_point_astray_are_told_of_real_fingers_and_nothing_of_right_points(finger):
    rest, pressed = (read_clicks(path) for path in finger.clicks)

    def said(places, scale="lengths"):
        clicks = rest, Clicks(places, None)
        found = clicked_points(*clicks, finger.markers, marker_radius=0.2, scale=scale, source="clicks")
        return " ".join(found.remarks)

    assert said(pressed.places) == ""
    right = clicked_points(rest, pressed, finger.markers, marker_radius=0.2, scale="lengths", source="clicks")
    assert said(pressed.places, right.scales) == ""
    one, other = right.scales
    assert "farther apart pressed than at rest" in said(pressed.places, (one, 1.08 * other))
    assert "closer together pressed than at rest" in said(pressed.places, (one, 0.92 * other))
    assert "farther apart at rest than on the drawing" in said(pressed.places, (1.08 * one, 1.08 * other))
    astray = pressed.places.copy()
    astray[4] += (7.0, -5.0)
    assert "point 5 moves unlike the points around it" in said(astray, right.scales)
