"""Pictures as a whole: their files, their colours, and type that neither overlaps nor leaves the page."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from PIL import Image

from compare.evaluation.convergence import with_certificates
from compare.evaluation.evaluation import Evaluation
from compare.evaluation.force_displacement import force_curves
from compare.figures import Figure, draw_all
from compare.figures.canvas import Canvas
from compare.figures.energy_chart import draw_energy
from compare.figures.fields import QUANTITIES, draw_field, field_extent
from compare.figures.force_chart import draw_force_displacement
from compare.figures.gallery import Gallery
from compare.figures.overlay import overlay_extent
from compare.figures.style import DPI, WIDTH
from geometry.finger.design import Design
from geometry.mesh.triangle_mesh import TriangleMesh
from geometry.observations import Observations
from solvers.problem import Load, Problem
from tests.compare.drawn_pages import Page


def with_certificate(evaluation: Evaluation, mesh: TriangleMesh) -> Evaluation:
    """The evaluation with its certificate, but not with the verdict."""
    (judged,) = with_certificates([evaluation], Problem(mesh))
    return replace(evaluation, certificate=judged.certificate)


@pytest.fixture(scope="module")
def said() -> list[tuple[float, str]]:
    return []


@pytest.fixture(scope="module")
def figures(
    pages: dict[Path, Page],
    said: list[tuple[float, str]],
    tmp_path_factory: pytest.TempPathFactory,
    mesh: TriangleMesh,
    fem: Evaluation,
    pinn: Evaluation,
    failed: Evaluation,
    observe: Callable[..., Observations],
) -> dict[str, Figure]:
    """All pictures of three solvers, of which one followed the load and failed, with one marker not seen."""
    steps = np.array([0.0, 0.2, 0.6])
    record = {"load_fraction": steps, "energy": steps**2, "reaction_x": 0 * steps, "reaction_y": -(steps**2)}
    followed = replace(with_certificate(failed, mesh), history=record)
    drawn = draw_all(
        tmp_path_factory.mktemp("figures"),
        design=Design(),
        mesh=mesh,
        load=Load(),
        evaluations=[fem, with_certificate(pinn, mesh), followed],
        observations=observe(fem.marker_displacement, hidden=(1,)),
        reference=fem,
        progress=lambda done, what: said.append((done, what)),
    )
    return {figure.path.stem: figure for figure in drawn}


FIELDS = tuple(quantity.name for quantity in QUANTITIES)
ALL = ("overlay", "marker_errors", *FIELDS, "force_displacement", "excess", "energy", "design", "mesh")


def test_the_pictures_come_in_the_order_of_the_report(figures: dict[str, Figure]) -> None:
    assert tuple(figures) == ALL


@pytest.mark.parametrize("name", ALL)
def test_the_file_is_an_image_of_the_width_of_a_page_that_is_not_blank(
    name: str, figures: dict[str, Figure]
) -> None:
    with Image.open(figures[name].path) as image:
        assert image.width == round(WIDTH * DPI)
        low, high = image.convert("L").getextrema()
    assert (low < 60, high) == (True, 255)


@pytest.mark.parametrize("name", ALL)
def test_no_text_leaves_the_page_or_runs_into_another(
    name: str, figures: dict[str, Figure], pages: dict[Path, Page]
) -> None:
    assert figures[name].caption.endswith(".")
    assert pages[figures[name].path].cut_off() == []
    assert pages[figures[name].path].overlaps() == []


def test_eight_solvers_find_room_too(
    pages: dict[Path, Page],
    tmp_path: Path,
    mesh: TriangleMesh,
    fem: Evaluation,
    pinn: Evaluation,
    failed: Evaluation,
    observations: Observations,
) -> None:
    pinn, failed = (with_certificate(evaluation, mesh) for evaluation in (pinn, failed))
    more = [replace(pinn, solver=f"pinn-{name}", converged=name != "asm") for name in ("local", "asm", "x")]
    told = replace(pinn, in_sample=True, left_out=pinn.marker_displacement + 0.5)
    more += [replace(told, solver="gp"), replace(told, solver="statfem", converged=False)]
    draw_all(
        tmp_path,
        design=Design(),
        mesh=mesh,
        load=Load(),
        evaluations=[fem, pinn, failed, *more],
        observations=observations,
        reference=fem,
    )
    for name in ("overlay", "marker_errors", "von_mises", "excess", "energy"):
        page = pages[tmp_path / f"{name}.png"]
        assert (name, page.cut_off(), page.overlaps()) == (name, [], [])


@pytest.mark.parametrize("name", ["overlay", "marker_errors", *FIELDS, "excess"])
def test_a_solver_that_failed_is_marked(
    name: str, figures: dict[str, Figure], pages: dict[Path, Page]
) -> None:
    assert "fem-nonlinear (not converged)" in pages[figures[name].path].text


@pytest.mark.parametrize("name", ["overlay", "marker_errors"])
def test_a_solver_that_was_given_the_markers_is_marked_at_them(
    name: str,
    pages: dict[Path, Page],
    tmp_path: Path,
    mesh: TriangleMesh,
    fem: Evaluation,
    pinn: Evaluation,
    observations: Observations,
) -> None:
    given = (fem, replace(pinn, in_sample=True))
    gallery = Gallery(tmp_path, Design(), mesh, Load(), given, observations, fem)
    figure = getattr(gallery, name)()
    assert "pinn-std †" in pages[figure.path].text
    assert "† was given these markers" in figure.caption


@pytest.mark.parametrize("name", ["overlay", "marker_errors"])
def test_simulated_markers_are_called_simulated(
    name: str, figures: dict[str, Figure], pages: dict[Path, Page]
) -> None:
    assert "simulated" in pages[figures[name].path].text
    assert "simulated by another solver" in figures[name].caption


def test_a_marker_that_was_not_seen_has_no_bar(figures: dict[str, Figure], pages: dict[Path, Page]) -> None:
    for axes in pages[figures["marker_errors"].path].figure.axes:
        middles = {round(bar.get_x() + bar.get_width() / 2) for bar in axes.patches}
        assert middles == {1, 3}
    assert pages[figures["marker_errors"].path].text.count("×") == 6


def test_progress_goes_from_none_to_all(figures: dict[str, Figure], said: list[tuple[float, str]]) -> None:
    shares = [share for share, _ in said]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1], len(said)) == (0.0, 1.0, len(ALL) + 2)  # no network has losses to draw


def area_of(colour: tuple[int, ...], path: Path) -> float:
    """Share of the picture that is within two units of a colour."""
    with Image.open(path) as image:
        pixels = np.asarray(image.convert("RGB"), dtype=int)
    return float((np.abs(pixels - colour).max(axis=2) <= 2).mean())


def test_a_field_of_half_the_size_has_the_colour_of_half_the_scale(
    fem: Evaluation, mesh: TriangleMesh, tmp_path: Path
) -> None:
    whole = replace(fem, von_mises=np.full(len(fem.weights), 2.0))
    half = replace(fem, solver="half", von_mises=np.full(len(fem.weights), 1.0))
    path = tmp_path / "field.png"
    with Canvas(mesh, field_extent(mesh), width=300) as canvas:
        draw_field(path, QUANTITIES[0], canvas=canvas, mesh=mesh, evaluations=[whole, half], reference=whole)
    viridis = mpl.colormaps["viridis"]
    full, middle = (viridis(share, bytes=True)[:3] for share in (1.0, 0.5))
    assert area_of(full, path) > 0.1
    assert area_of(middle, path) == pytest.approx(area_of(full, path), rel=0.1)


def test_the_overlay_shows_the_whole_of_every_solution_that_converged(
    mesh: TriangleMesh, pinn: Evaluation, failed: Evaluation, observations: Observations
) -> None:
    extent = overlay_extent(mesh, [pinn, failed], observations)
    lowest = (mesh.points + pinn.node_displacement)[:, 1].min()
    assert extent.bottom < lowest
    assert extent.bottom > (mesh.points + failed.node_displacement)[:, 1].min()
    assert extent.top > 0


def test_the_reference_energy_is_a_line(figures: dict[str, Figure], pages: dict[Path, Page]) -> None:
    energies, distances, *_ = pages[figures["energy"].path].figure.axes
    assert [2.0, 2.0] in [list(line.get_ydata()) for line in energies.get_lines()]
    np.testing.assert_allclose(distances.get_lines()[0].get_ydata(), [44.0, 1.0, 0.21])


def test_no_remark_on_a_field_lies_on_a_slender_finger(
    fem: Evaluation, pinn: Evaluation, mesh: TriangleMesh, pages: dict[Path, Page], tmp_path: Path
) -> None:
    x, y = mesh.points.T
    length, width = float(np.ptp(x)), float(np.ptp(y))
    points = np.column_stack([x, y * (1.01 - x / length) * 28 / 120 * length / width])
    finger = replace(mesh, points=points)
    for quantity in QUANTITIES:
        path = tmp_path / f"{quantity.name}.png"
        with Canvas(finger, field_extent(finger), width=300) as canvas:
            draw_field(path, quantity, canvas=canvas, mesh=finger, evaluations=[fem, pinn], reference=fem)
        for axes in pages[path].figure.axes:
            corners = axes.transData.transform(points)
            for text in axes.texts:
                if text.get_text().startswith(("largest", "rel.")):
                    box = text.get_window_extent()
                    covered = [corner for corner in corners if box.contains(*corner)]
                    assert (quantity.name, text.get_text(), covered) == (quantity.name, text.get_text(), [])
        assert (quantity.name, pages[path].cut_off(), pages[path].overlaps()) == (quantity.name, [], [])


def test_the_number_beside_a_field_is_its_largest_mean_of_a_triangle(
    fem: Evaluation, mesh: TriangleMesh, pages: dict[Path, Page], tmp_path: Path
) -> None:
    peak = replace(fem, von_mises=np.zeros(len(fem.weights)))
    peak.von_mises[0] = 3.0  # at one of a triangle's three points, which have equal weights
    path = tmp_path / "field.png"
    with Canvas(mesh, field_extent(mesh), width=300) as canvas:
        draw_field(path, QUANTITIES[0], canvas=canvas, mesh=mesh, evaluations=[peak], reference=peak)
    assert "= 1 MPa" in pages[path].text


def test_ticks_of_six_characters_leave_room_for_the_labels(
    fem: Evaluation, pinn: Evaluation, pages: dict[Path, Page], tmp_path: Path
) -> None:
    history = {"units": np.array([3200.0, 8000.0]), "energy": np.array([1.1015, 1.0881])}
    followed = {"load_fraction": np.array([0.0, 1.0]), "reaction_x": np.zeros(2), "reaction_y": [0, -0.0021]}
    near = replace(fem, energy=1.0924)
    path = tmp_path / "energy.png"
    draw_energy(path, evaluations=[near, replace(pinn, history=history)], reference=near)
    assert pages[path].cut_off() == []
    path = tmp_path / "force.png"
    follower = replace(pinn, history=followed, reaction=np.array([0.0, -0.0021]))
    draw_force_displacement(path, curves=force_curves([follower], Load()), depth=20.0)
    assert pages[path].cut_off() == []
