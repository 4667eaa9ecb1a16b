"""Pictures as a whole: their files, their colours, and type that neither overlaps nor leaves the page."""

import itertools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure as MplFigure
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from PIL import Image

from compare.evaluation import Evaluation
from compare.figures import Figure, draw_all
from compare.figures.canvas import Canvas
from compare.figures.design_drawing import draw_design
from compare.figures.energy_chart import approaches_reference, draw_energy, readable, recorded, wants_log
from compare.figures.fields import QUANTITIES, draw_field, field_extent
from compare.figures.overlay import overlay_extent
from compare.figures.style import DPI, WIDTH
from geometry.design import Design
from geometry.mesh import TriangleMesh
from geometry.observations import Observations
from geometry.parameters import Parameters
from geometry.presets import load_design, preset_names

MODULES = ("overlay", "marker_chart", "fields", "energy_chart", "design_drawing", "mesh_drawing")


class Page(NamedTuple):
    """A matplotlib figure and what it wrote where, in pixels, when it was drawn."""

    figure: MplFigure
    words: list[tuple[str, Bbox]]

    @property
    def text(self) -> str:
        return "\n".join(word for word, _ in self.words)

    def overlaps(self) -> list[tuple[str, str]]:
        """Pairs of words that cover each other by more than a pixel."""
        return [
            (a, b)
            for (a, one), (b, two) in itertools.combinations(self.words, 2)
            if min(one.x1, two.x1) - max(one.x0, two.x0) > 1 and min(one.y1, two.y1) - max(one.y0, two.y0) > 1
        ]

    def cut_off(self) -> list[str]:
        """Words that leave the page."""
        page = self.figure.bbox
        return [
            a for a, box in self.words if box.x0 < 0 or box.y0 < 0 or box.x1 > page.x1 or box.y1 > page.y1
        ]


@pytest.fixture(scope="module")
def pages() -> Iterator[dict[Path, Page]]:
    """Every matplotlib figure that was drawn, by its file."""
    seen: dict[Path, Page] = {}
    words: list[tuple[str, Bbox]] = []
    draw = Text.draw

    def noted(text: Text, renderer: RendererBase) -> None:
        draw(text, renderer)
        if text.get_visible() and text.get_text().strip():
            words.append((text.get_text(), text.get_window_extent(renderer)))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Text, "draw", noted)
        for module in map(import_module, (f"compare.figures.{name}" for name in MODULES)):

            @contextmanager
            def watched(
                path: Path, height: float, original: Callable[..., Any] = module.figure
            ) -> Iterator[MplFigure]:
                words.clear()
                with original(path, height) as drawn:
                    yield drawn
                seen[path] = Page(drawn, list(words))

            patch.setattr(module, "figure", watched)
        yield seen


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
    """All pictures of three solvers, of which one failed, with one marker not seen."""
    drawn = draw_all(
        tmp_path_factory.mktemp("figures"),
        design=Design(),
        mesh=mesh,
        evaluations=[fem, pinn, failed],
        observations=observe(fem.marker_displacement, hidden=(1,)),
        reference=fem,
        progress=lambda done, what: said.append((done, what)),
    )
    return {figure.path.stem: figure for figure in drawn}


ALL = ("overlay", "marker_errors", *(quantity.name for quantity in QUANTITIES), "energy", "design", "mesh")


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


def test_six_solvers_find_room_too(
    pages: dict[Path, Page],
    tmp_path: Path,
    mesh: TriangleMesh,
    fem: Evaluation,
    pinn: Evaluation,
    failed: Evaluation,
    observations: Observations,
) -> None:
    more = [replace(pinn, solver=f"pinn-{name}", converged=name != "asm") for name in ("local", "asm", "x")]
    draw_all(
        tmp_path,
        design=Design(),
        mesh=mesh,
        evaluations=[fem, pinn, failed, *more],
        observations=observations,
        reference=fem,
    )
    for name in ("overlay", "marker_errors", "von_mises", "energy"):
        page = pages[tmp_path / f"{name}.png"]
        assert (name, page.cut_off(), page.overlaps()) == (name, [], [])


@pytest.mark.parametrize("name", ["overlay", "marker_errors", *(quantity.name for quantity in QUANTITIES)])
def test_a_solver_that_failed_is_marked(
    name: str, figures: dict[str, Figure], pages: dict[Path, Page]
) -> None:
    assert "fem-nonlinear (not converged)" in pages[figures[name].path].text


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
    assert pages[figures["marker_errors"].path].text.count("not seen") == 2


def test_progress_goes_from_none_to_all(figures: dict[str, Figure], said: list[tuple[float, str]]) -> None:
    shares = [share for share, _ in said]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1], len(said)) == (0.0, 1.0, len(ALL) + 1)


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


def test_records_are_grouped_by_their_first_column(
    fem: Evaluation, pinn: Evaluation, evaluate: Callable[..., Evaluation]
) -> None:
    steps = np.array([0.0, 1.0])
    other = evaluate("other", history={"load_fraction": steps, "reaction": steps, "energy": steps})
    loss = evaluate("loss", history={"seconds": steps, "loss": steps})
    assert recorded([fem, pinn, other, loss]) == {
        ("units", "energy"): [pinn],
        ("load_fraction", "energy"): [other],
        ("seconds", "loss"): [loss],
    }


def test_without_a_record_there_is_no_chart_of_energy(fem: Evaluation, tmp_path: Path) -> None:
    assert not draw_energy(tmp_path / "energy.png", evaluations=[fem], reference=fem)
    assert not (tmp_path / "energy.png").exists()


def test_the_reference_energy_is_a_line(figures: dict[str, Figure], pages: dict[Path, Page]) -> None:
    energies, distances = pages[figures["energy"].path].figure.axes
    assert [2.0, 2.0] in [list(line.get_ydata()) for line in energies.get_lines()]
    np.testing.assert_allclose(distances.get_lines()[0].get_ydata(), [44.0, 1.0, 0.21])


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([1.0, 30.0], True),  # more than a factor of twenty
        ([1.0, 10.0], False),  # less
        ([0.0, 30.0], False),  # zero has no logarithm
        ([-1.0, 30.0], False),  # nor has a negative number
        ([np.nan, 1.0, 30.0], True),  # gaps do not count
    ],
)
def test_axes_are_logarithmic_where_that_helps(values: list[float], expected: bool) -> None:
    assert wants_log(np.array(values)) is expected


def test_a_growing_load_does_not_approach_the_reference() -> None:
    assert approaches_reference(("units", "energy"))
    assert not approaches_reference(("load_fraction", "energy"))
    assert not approaches_reference(("units", "loss"))
    assert readable("newton_iterations") == "newton iterations"


DESIGNS = {
    **{name: load_design(name) for name in preset_names()},
    "joints": Design(marker_layout="joints", rib_angle=-15, fillet_radius=1.2),
    "without ribs": Design(rib_count=0),
    "one rib": Design(rib_count=1, rib_angle=0, tip_length=40),
}


@pytest.mark.parametrize("design", DESIGNS.values(), ids=DESIGNS)
def test_a_drawing_has_every_dimension_and_none_overlaps(
    design: Parameters, pages: dict[Path, Page], tmp_path: Path
) -> None:
    draw_design(tmp_path / "drawing.png", design)
    text = pages[tmp_path / "drawing.png"].text
    expected = [
        rf"$H$ = {design.height:g} mm",
        rf"$L$ = {design.base_width:g} mm",
        rf"$W$ = {design.depth:g} mm",
        rf"$L_\mathrm{{tip}}$ = {design.tip_length:g} mm",
        rf"$t_\mathrm{{flex}}$ = {design.front_thickness:g} mm",
        rf"$t_\mathrm{{back}}$ = {design.back_thickness:g} mm",
        rf"$N$ = {design.rib_count} ribs",
    ]
    if design.rib_count:
        expected += [rf"$t_\mathrm{{rib}}$ = {design.rib_thickness:g} mm", r"$L_\mathrm{angle}$"]
    assert [dimension for dimension in expected if dimension not in text] == []
    numerals = {str(number) for number in range(1, 100)}
    assert pages[tmp_path / "drawing.png"].cut_off() == []
    assert [pair for pair in pages[tmp_path / "drawing.png"].overlaps() if not numerals & set(pair)] == []
