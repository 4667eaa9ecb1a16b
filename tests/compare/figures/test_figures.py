"""Pictures as a whole: their files, their colours, and type that neither overlaps nor leaves the page."""

import re
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from PIL import Image

from pinnray.comparison.evaluation.certifier import with_certificates
from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.figures import FORMATS, draw_all, page_width
from pinnray.comparison.figures.fields import QUANTITIES, draw_field
from pinnray.comparison.figures.gallery import GALLERY, Illustration, draw
from pinnray.comparison.figures.overlay import overlay_extent
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.errors import UserError
from pinnray.runtime.figure import DPI, WIDTH
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Estimated, IdentifiedForce
from tests.compare.figures.drawn_pages import Page, page_of, printed

pytestmark = pytest.mark.slow


def certificate_of(evaluation: Evaluation, mesh: TriangleMesh) -> Evaluation:
    """The evaluation with its certificate, but not with the verdict."""
    (judged,) = with_certificates([evaluation], Problem(mesh))
    return replace(evaluation, certificate=judged.certificate)


@pytest.fixture(scope="module")
def comparison(mesh, fem, pinn, failed, observe, compared) -> Results:
    """Three solvers, of which one followed the load and failed, with one marker not seen."""
    steps = np.array([0.0, 0.2, 0.6])
    record = {"load_fraction": steps, "energy": steps**2, "reaction_x": 0 * steps, "reaction_y": -(steps**2)}
    followed = replace(certificate_of(failed, mesh), history=record)
    observations = observe(fem.marker_displacement, hidden=(1,))
    return compared(fem, certificate_of(pinn, mesh), followed, observations=observations)


LIKE_OTHERS = ("strain_xx", "strain_yy", "strain_principal")
"""Fields that are drawn as another one."""


@pytest.fixture(scope="module")
def drawings(comparison: Results) -> dict[str, Illustration]:
    """The pictures of the comparison, of the fields two; no network of it has losses to draw."""
    drawings = {
        name: draw(comparison, WIDTH) for name, (_, draw) in GALLERY.items() if name not in LIKE_OTHERS
    }
    return {name: drawing for name, drawing in drawings.items() if drawing is not None}


@pytest.fixture(scope="module")
def pages(drawings: dict[str, Illustration]) -> dict[str, Page]:
    return {name: page_of(drawing.figure) for name, drawing in drawings.items()}


@pytest.mark.parametrize("kind", FORMATS)
def test_every_picture_is_written_for_print_too(comparison, drawings, tmp_path, kind, monkeypatch) -> None:
    """In letters, not in pixels; and the same file every time."""
    monkeypatch.setattr("pinnray.comparison.figures.gallery.GALLERY", {"design": GALLERY["design"]})
    first, second = (
        [path.read_bytes() for path in sorted(folder.glob(f"*.{kind}"))]
        for folder in (tmp_path / "first", tmp_path / "second")
        if draw_all(folder, comparison, formats=[kind])
    )
    assert len(first) == 1
    assert first == second
    assert all((b"/FontFile2" if kind == "pdf" else b"<path") in content for content in first)


FIELDS = tuple(quantity.name for quantity in QUANTITIES if quantity.name not in LIKE_OTHERS)
ALL = (*FIELDS, "overlay", "marker_errors", "force_displacement", "design", "mesh")


def test_every_picture_is_written_in_the_order_of_the_report(comparison, drawings, tmp_path, monkeypatch):
    """Each is as wide as a page, and not blank; progress goes from none to all."""
    drawn = {name: (title, lambda *_, name=name: drawings.get(name)) for name, (title, _) in GALLERY.items()}
    monkeypatch.setattr("pinnray.comparison.figures.gallery.GALLERY", drawn)
    said: list[float] = []
    pictures = draw_all(tmp_path, comparison, lambda done, _: said.append(done))
    assert [picture.path.stem for picture in pictures] == list(ALL) == list(drawings)
    assert sorted(tmp_path.iterdir()) == sorted(picture.path for picture in pictures)
    assert [picture.caption for picture in pictures] == [each.caption for each in drawings.values()]
    assert said == sorted(said)
    assert (said[0], said[-1], len(said)) == (0.0, 1.0, len(GALLERY) + 1)
    for picture in pictures:
        with Image.open(picture.path) as image:
            assert image.width == round(WIDTH * DPI)
            low, high = image.convert("L").getextrema()
        assert (picture.path.stem, low < 60, high) == (picture.path.stem, True, 255)


@pytest.mark.parametrize("name", ALL)
def test_no_text_leaves_the_page_or_runs_into_another(name, drawings, pages):
    assert drawings[name].caption.endswith(".")
    assert pages[name].cut_off() == []
    assert pages[name].overlaps() == []


@pytest.mark.parametrize("width", [85.0, 180.0])
def test_pictures_for_a_journal_have_its_width_and_type_that_fits(comparison, failed, pinn, width, compared):
    """Nine solvers of long names, most of them not converged, on a column of a journal and on its page."""
    record = {"epoch": np.arange(1.0, 4.0), "PDE": np.ones(3), "BC": np.ones(3), "ASM": np.ones(3)}
    force = IdentifiedForce(Estimated(0.5, 0.4, 0.8), Estimated(0, 0, 0.1), Estimated(36.0, 35.0, 37.5))
    told = replace(failed, in_sample=True, left_out=failed.marker_displacement, identified=force)
    more = [replace(told, solver=f"pinn-id-long-{n}", history=record) for n in range(3)]
    more += [replace(pinn, solver=f"pinn-long-{n}") for n in range(3)]
    nine = compared(*comparison.evaluations, *more, observations=comparison.observations)
    nine = replace(nine, design=nine.design.replaced(name="default-rib_count-6-height-110-t_rib-1.25"))
    for name in GALLERY:
        page = page_of(draw(nine, name, page=page_width(width)).figure)
        assert (name, page.cut_off(), page.overlaps()) == (name, [], [])
        assert page.figure.get_figwidth() * 25.4 == pytest.approx(width)
        assert page.figure.get_figheight() < 11
        assert printed(page.figure)[1] >= 7
        assert page.largest <= 9
    with pytest.raises(UserError, match="80 to 200 mm"):
        page_width(40.0)


@pytest.mark.parametrize("name", ["overlay", "marker_errors", *FIELDS])
def test_a_solver_that_failed_is_marked(name: str, pages: dict[str, Page]) -> None:
    assert "fem-nonlinear (not converged)" in pages[name].text


def test_pictures_say_which_errors_are_held_out_and_which_are_of_training(fem, pinn, observations, compared):
    told = replace(pinn, in_sample=True, left_out=pinn.marker_displacement + 0.5)
    untold = replace(told, solver="pinn-x", left_out=None)
    comparison = compared(fem, told, untold)
    own = comparison.scores[told.solver]
    errors = own.held_out, own.markers
    overlay, bars = (page_of(draw(comparison, name).figure) for name in ("overlay", "marker_errors"))
    for kind, found in zip(("held out", "training"), errors, strict=True):
        assert found is not None
        assert f"MAE {kind}: u {found.mae_u:.3f}, v {found.mae_v:.3f} mm" in overlay.text
        assert f"{found.mae_u:.3f} {kind}" in bars.text
    assert "pinn-std †" in overlay.text
    assert "pinn-std †" in bars.text
    assert "simulated" in overlay.text
    assert "simulated" in bars.text
    assert (overlay.cut_off(), overlay.overlaps(), bars.cut_off(), bars.overlaps()) == ([], [], [], [])


def test_a_circle_shows_a_training_error_that_vanishes(fem, pinn, observations, compared):
    met = replace(pinn, in_sample=True, marker_displacement=observations.displacements.copy())
    figure = draw(compared(fem, met), "marker_errors").figure
    (circles,) = figure.axes[2].lines
    assert circles.get_marker() == "o"
    assert figure.axes[2].get_yscale() == "log"  # which has no zero: the circle is at the lower end
    np.testing.assert_array_equal(circles.get_ydata(), figure.axes[2].get_ylim()[0])


def test_a_marker_that_was_not_seen_has_no_bar(pages: dict[str, Page]) -> None:
    for axes in pages["marker_errors"].figure.axes:
        middles = {round(bar.get_x() + bar.get_width() / 2) for bar in axes.patches}  # type: ignore[attr-defined]
        assert middles == {1, 3}
    assert pages["marker_errors"].text.count("×") == 6


def area_of(colour: tuple[int, ...], path: Path) -> float:
    """Share of the picture that is within two units of a colour."""
    with Image.open(path) as image:
        pixels = np.asarray(image.convert("RGB"), dtype=int)
    return float((np.abs(pixels - colour).max(axis=2) <= 2).mean())


def test_a_field_of_half_the_size_has_the_colour_of_half_the_scale(fem, compared, tmp_path):
    whole = replace(fem, von_mises=np.full(len(fem.weights), 2.0))
    half = replace(fem, solver="half", von_mises=np.full(len(fem.weights), 1.0))
    path = draw(compared(whole, half), "von_mises", ["half"]).figure.save(tmp_path / "field.png")
    viridis = mpl.colormaps["viridis"]
    full, middle = (viridis(share, bytes=True)[:3] for share in (1.0, 0.5))
    assert area_of(full, path) > 0.1
    assert area_of(middle, path) == pytest.approx(area_of(full, path), rel=0.1)


def test_the_overlay_shows_the_whole_of_every_solution_that_converged(mesh, pinn, failed, compared):
    extent = overlay_extent(compared(pinn, failed), 5.0)
    lowest = (mesh.points + pinn.node_displacement)[:, 1].min()
    assert extent.bottom < lowest
    assert extent.bottom > (mesh.points + failed.node_displacement)[:, 1].min()
    assert extent.top > 0


def test_no_remark_on_a_field_lies_on_a_slender_finger(fem, pinn, mesh, compared):
    x, y = mesh.points.T
    length, width = float(np.ptp(x)), float(np.ptp(y))
    points = np.column_stack([x, y * (1.01 - x / length) * 28 / 120 * length / width])
    finger = replace(mesh, points=points)
    for quantity in (QUANTITIES[0], QUANTITIES[-1]):
        page = page_of(draw_field(compared(fem, pinn, mesh=finger), quantity))
        for axes in page.figure.axes:
            corners = axes.transData.transform(points)
            for text in axes.texts:
                if text.get_text().startswith(("largest", "rel.")):
                    box = text.get_window_extent()
                    covered = [corner for corner in corners if box.contains(*corner)]
                    assert (quantity.name, text.get_text(), covered) == (quantity.name, text.get_text(), [])
        assert (quantity.name, page.cut_off(), page.overlaps()) == (quantity.name, [], [])


def test_the_number_beside_a_field_is_its_largest_mean_of_a_triangle(fem, compared):
    peak = replace(fem, von_mises=np.zeros(len(fem.weights)))
    peak.von_mises[0] = 3.0  # at one of a triangle's three points, which have equal weights
    assert "largest 1 MPa" in page_of(draw(compared(peak), "von_mises").figure).text


def test_ticks_of_six_characters_leave_room_for_the_labels(pinn, compared):
    followed = {"load_fraction": np.array([0.0, 1.0]), "reaction_x": np.zeros(2), "reaction_y": [0, -0.0021]}
    follower = replace(pinn, history=followed, reaction=np.array([0.0, -0.0021]))
    assert page_of(draw(compared(follower), "force_displacement").figure).cut_off() == []


def test_errors_of_solvers_that_are_far_apart_are_all_seen(fem, pinn, compared, observations):
    """A hundredth of another solver's error still has a bar to be seen."""
    near = replace(pinn, marker_displacement=observations.displacements + np.array([0.003, -0.004]))
    figure = draw(compared(fem, near), "marker_errors").figure
    heights = []
    for axes in (figure.axes[0], figure.axes[2]):
        low, high = np.log10(axes.get_ylim())
        heights.append((np.log10(axes.patches[0].get_height()) - low) / (high - low))  # type: ignore[attr-defined]
    assert min(heights) > 0.1


def test_differences_are_from_the_truth_where_it_is_known(fem, pinn, evaluate, compared):
    known = compared(fem, pinn, truth=evaluate("fem-nonlinear", 1.05))
    text = page_of(draw(known, "von_mises").figure).text
    assert (text.count("minus truth"), text.count("minus fem")) == (2, 0)
    distances = [float(found) for found in re.findall(r"rel. L² ([\d.]+)\s%", text)]
    assert distances == pytest.approx([100 * 0.05 / 1.05] * 2, rel=0.01)  # 1 and 1.1 from 1.05
    assert "truth, simulated" in text.splitlines()[1:4]


@pytest.mark.parametrize("width", [85.0, 180.0])
def test_words_and_marks_know_how_wide_the_page_is(width, fem, pinn, evaluate, compared):
    history = {"load_fraction": np.array([0.0, 1.0]), "reaction_x": np.zeros(2), "reaction_y": [0, -0.2]}
    follower = replace(pinn, history=history, reaction=np.array([0.0, -0.2]))
    truth = replace(evaluate("fem-nonlinear", 1.05), history=history, reaction=np.array([0.0, -0.2]))
    known, page = compared(fem, follower, truth=truth), page_width(width)
    where = "Below" if width < 90 else "Right"
    assert f"{where}: the field minus" in draw(known, "von_mises", page=page).caption
    chart = draw(known, "force_displacement", page=page).figure
    chart.canvas.draw()
    axes, half = chart.axes[0], 4.4 / 72 * chart.dpi  # pixels: half a cross with its line
    (cross,) = (line for line in axes.lines if line.get_marker() == "x")
    assert axes.transData.transform(cross.get_xydata())[0, 0] + half <= axes.bbox.x1


def test_a_picture_of_fields_fits_a_page_and_has_the_chosen_solvers(fem, pinn, compared, evaluate):
    many = [evaluate(f"solver-{n}", 1.1 + 0.1 * n, converged=n != 1) for n in range(14)]
    comparison = compared(fem, *many)
    drawing = draw(comparison, "von_mises")
    assert drawing.figure.get_size_inches()[1] <= 9
    assert "solver-1 (not converged)" in drawing.caption.split("Left out")[1]
    chosen = page_of(draw(comparison, "von_mises", ["solver-13", "solver-12"]).figure)
    assert [word for word, _ in chosen.words if word.startswith("solver-")] == ["solver-12", "solver-13"]
