"""The viewer of the report: moved, compared, played and saved as a reader does it, in Chromium."""

import io
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, expect

from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray
from tests.compare.report.browser import opened

pytestmark = pytest.mark.slow

ZOOM = "pinnrayViewer.look.scale"
FOOT = -44
"""Rows below the body, for bars of colour and length."""
SOLVER = "pinnrayFields.manifest.solvers[%d]"


@pytest.fixture(scope="module")
def ready(browser: Browser, written: Path) -> Page:
    """The page with its viewer ready, which takes seconds."""
    page = opened(browser, written).page
    page.locator("#viewer").scroll_into_view_if_needed()
    page.locator("#viewer[data-ready]").wait_for()
    return page


@pytest.fixture
def viewer(ready: Page) -> Page:
    """The page with its viewer in sight, and each of its controls as at the start."""
    ready.set_viewport_size({"width": 1400, "height": 900})
    ready.evaluate(
        "for (const each of document.querySelectorAll('#viewer select')) each.selectedIndex = 0;"
        "document.getElementById('viewer-marks').checked = true;"
        "document.getElementById('viewer-load').value = 100;"
        "document.getElementById('viewer-beside').dispatchEvent(new Event('input'));"
        "document.getElementById('viewer-all').click();"
    )
    ready.locator("#viewer").scroll_into_view_if_needed()
    return ready


def shot(page: Page) -> FloatArray:
    """The canvas as it is seen: shape (height, width, 3)."""
    image = Image.open(io.BytesIO(page.locator("#viewer-canvas").screenshot())).convert("RGB")
    return np.asarray(image, dtype=np.float64)


def test_the_page_scrolls_past_the_viewer(viewer: Page) -> None:
    """A wheel over it scrolls the page; with Ctrl, or after a click into it, the wheel zooms."""
    box = viewer.locator("#viewer-canvas").bounding_box()
    viewer.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    before, place = viewer.evaluate(ZOOM), viewer.evaluate("scrollY")
    viewer.mouse.wheel(0, 20)
    viewer.wait_for_function(f"scrollY > {place}")
    viewer.wait_for_timeout(200)
    assert viewer.evaluate(ZOOM) == before
    place = viewer.evaluate("scrollY")
    viewer.keyboard.down("Control")
    viewer.mouse.wheel(0, -120)
    viewer.wait_for_function(f"{ZOOM} != {before}")
    viewer.keyboard.up("Control")
    viewer.mouse.down()
    viewer.mouse.up()
    zoomed = viewer.evaluate(ZOOM)
    viewer.mouse.wheel(0, -120)
    viewer.wait_for_function(f"{ZOOM} != {zoomed}")
    assert viewer.evaluate("scrollY") == place
    viewer.keyboard.press("Escape")
    viewer.mouse.wheel(0, 20)
    viewer.wait_for_function(f"scrollY > {place}")


@pytest.mark.parametrize("width", [1400, 390])
def test_nothing_is_clipped(viewer: Page, width: int) -> None:
    """Nothing of the picture touches its edges, with the solver that moves the farthest."""
    viewer.set_viewport_size({"width": width, "height": 900})
    viewer.select_option("#viewer-solver", index=2)
    viewer.wait_for_timeout(500)
    seen = shot(viewer)
    edges = [seen[1, 2:-2], seen[2:-2, 1], seen[2:-2, -2], seen[-2, 2:-2]]
    assert [float(np.ptp(edge)) for edge in edges] == [0.0] * 4
    assert np.ptp(seen) > 100


def test_markers_and_contact_are_drawn_where_they_are(viewer: Page, pinn, mesh, observations) -> None:
    viewer.select_option("#viewer-solver", label="pinn-std")
    viewer.wait_for_timeout(300)
    marks = viewer.evaluate("pinnrayViewer.shown[0].marks")
    seen, crosses, arrow = (np.array(marks[name]) for name in ("seen", "crosses", "way"))
    np.testing.assert_allclose(seen, observations.points + observations.displacements, atol=1e-6)
    np.testing.assert_allclose(crosses, mesh.markers + pinn.marker_displacement, atol=2e-3)
    contact = np.unique(mesh.boundary("contact"))
    way = [mesh.points[contact], (mesh.points + pinn.node_displacement)[contact]]
    np.testing.assert_allclose(arrow[:2], [places.mean(axis=0) for places in way], atol=1e-6)
    pink = np.abs(shot(viewer) - (0xD1, 0x00, 0x6C)).max(axis=2) < 40
    assert pink.sum() > 20
    viewer.uncheck("#viewer-marks")
    viewer.wait_for_timeout(300)
    assert not (np.abs(shot(viewer) - (0xD1, 0x00, 0x6C)).max(axis=2) < 40).any()


def test_the_colour_bar_says_where_values_go_beyond_its_ends(viewer: Page) -> None:
    viewer.select_option("#viewer-quantity", label="Displacement magnitude")
    for solver in ("fem", "pinn-std"):
        viewer.select_option("#viewer-solver", label=solver)
        viewer.wait_for_timeout(300)
        shown = "pinnrayViewer.shown[0]"
        high = viewer.evaluate("pinnrayFields.manifest.quantities[0].high")
        most = viewer.evaluate(f"Math.max(...{shown}.field)")
        least, end, _ = viewer.evaluate(f"{shown}.ends")
        assert most > high
        assert end.startswith("≥ ")
        assert not least.startswith("≤")


@pytest.mark.parametrize("key", ["0", "-"])
def test_the_scale_bar_has_its_length(viewer: Page, mesh: TriangleMesh, key: str) -> None:
    """Beside the body at rest, which is as long as the mesh, at each zoom."""
    viewer.uncheck("#viewer-marks")
    viewer.locator("#viewer-load").fill("0")
    viewer.locator("#viewer-canvas").focus()
    viewer.keyboard.press(key)
    viewer.wait_for_timeout(400)
    bar = viewer.evaluate("pinnrayViewer.bar")
    rows = shot(viewer)[:FOOT]
    body = np.flatnonzero((np.ptp(rows, axis=2) > 30).any(axis=0))  # coloured: neither page nor outline
    assert (body[-1] - body[0]) / np.ptp(mesh.points[:, 0]) == pytest.approx(
        bar["pixels"] / bar["length"], rel=0.02
    )


def fields(page: Page, solver: int, quantity: int, load: float, against: str = "undefined") -> FloatArray:
    panel = f"{{ solver: {SOLVER % solver}, number: {quantity}, against: {against} }}"
    return np.array(page.evaluate(f"Array.from(pinnrayFields.values({panel}, {load}))"))


def test_a_field_is_shown_minus_the_truth(viewer: Page, pinn: Evaluation, truth: Evaluation) -> None:
    viewer.select_option("#viewer-solver", label="pinn-std")
    viewer.select_option("#viewer-quantity", label="Von Mises stress")
    viewer.select_option("#viewer-show", label="minus truth")
    expect(viewer.locator("#viewer-title")).to_have_text("Von Mises stress, MPa: pinn-std minus truth")
    expect(viewer.locator("#viewer-note")).to_contain_text("a scale of its own")
    expected = pinn.per_triangle(pinn.von_mises - truth.von_mises)
    found = fields(viewer, 1, 1, 1.0, "'truth'")
    np.testing.assert_allclose(found, expected, atol=1e-3 * np.abs(expected).max())
    viewer.select_option("#viewer-solver", label="truth (simulated)")
    expect(viewer.locator("#viewer-note")).to_contain_text("is what the others are compared with")


def test_two_fields_lie_side_by_side_and_move_together(viewer: Page) -> None:
    viewer.select_option("#viewer-beside", label="pinn-std")
    viewer.wait_for_timeout(400)
    expect(viewer.locator("#viewer-title")).to_have_text(re.compile("left fem; right pinn-std$"))
    coloured = np.ptp(shot(viewer)[:FOOT], axis=2) > 30
    middle = coloured.shape[1] // 2
    assert coloured[:, : middle - 5].sum() == pytest.approx(coloured[:, middle + 5 :].sum(), rel=0.2)
    viewer.locator("#viewer-in").click()
    left, right = viewer.evaluate("pinnrayViewer.shown.map(({ at }) => at.scale)")
    assert left == right
    viewer.select_option("#viewer-beside", label="the same minus truth")
    expect(viewer.locator("#viewer-title")).to_have_text(re.compile("left fem; right fem minus truth$"))


def test_the_picture_is_saved_as_png(viewer: Page) -> None:
    with viewer.expect_download() as waiting:
        viewer.get_by_role("button", name="Save as PNG").click()
    assert waiting.value.suggested_filename == "default-Displacement-magnitude-mm-fem.png"
    with Image.open(waiting.value.path()) as image:
        assert image.format == "PNG"
        assert image.width > 1500
        assert len(image.convert("RGB").getcolors(image.width * image.height)) > 100


def test_colours_follow_the_load(viewer: Page, pinn, followed, mesh) -> None:
    """In proportion for the linear law; with the strain of the recorded displacements along a path."""
    whole, half = (fields(viewer, 1, 1, load) for load in (1.0, 0.5))
    np.testing.assert_allclose(half, 0.5 * whole, rtol=1e-12)
    moved = followed.path[1][mesh.triangles]
    sides = mesh.points[mesh.triangles][:, 1:] - mesh.points[mesh.triangles][:, :1]
    gradient = np.linalg.solve(sides, moved[:, 1:] - moved[:, :1]).transpose(0, 2, 1)
    transposed = gradient.transpose(0, 2, 1)
    strain = (gradient + transposed + transposed @ gradient) / 2
    names = viewer.evaluate("pinnrayFields.manifest.quantities.map(({ name }) => name)")
    for name, (row, column) in {"strain_xx": (0, 0), "strain_yy": (1, 1), "strain_xy": (0, 1)}.items():
        full = 100 * followed.per_triangle(followed.strain)[:, row, column]
        end = fields(viewer, 2, names.index(name), 1.0)
        np.testing.assert_allclose(end, full, atol=1e-3 * np.abs(full).max() + 1e-9)
        found = fields(viewer, 2, names.index(name), 0.5)
        last = followed.path[2][mesh.triangles]
        far = np.linalg.solve(sides, last[:, 1:] - last[:, :1]).transpose(0, 2, 1)
        green = 100 * (far + far.transpose(0, 2, 1) + far.transpose(0, 2, 1) @ far) / 2
        expected = 100 * strain[:, row, column] + 0.5 * (full - green[:, row, column])
        np.testing.assert_allclose(found, expected, atol=0.02 * np.abs(full).max() + 0.02)
