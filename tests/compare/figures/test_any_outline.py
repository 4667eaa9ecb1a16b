"""Pictures and report of bodies that are no wedge: a ring is square, a beam thin, a foot has two soles."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import LineCollection

from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.evaluation.evaluation import evaluated
from pinnray.comparison.figures.gallery import draw
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.finger.presets import load_design
from pinnray.geometry.mesh.mesher import build_mesh
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.observations import Observations
from tests.compare.conftest import BendingField, closed_form
from tests.compare.figures.drawn_pages import Page, page_of
from tests.fingers import beam, ring

pytestmark = pytest.mark.slow

FINGERS: dict[str, Finger] = {"ring": ring(), "beam": beam(), "csiro": load_design("csiro")}


def compared(finger: Finger) -> Results:
    """Two solvers with a known field, on a coarse mesh."""
    mesh = build_mesh(finger, MeshSettings(size=2.0))
    evaluations = [
        evaluated(closed_form(mesh, BendingField(scale), solver=name), mesh)
        for name, scale in (("fem", 0.02), ("pinn-std", 0.021))
    ]
    observations = Observations(
        points=mesh.markers,
        displacements=evaluations[0].marker_displacement + 0.1,
        standard_deviations=np.zeros_like(mesh.markers),
        visible=np.ones(len(mesh.markers), dtype=bool),
        source="simulated by another solver",
        simulated=True,
        marker_radius=0.8,
    )
    return Results(finger, mesh, observations, evaluations, evaluations[0])


@pytest.fixture(scope="module", params=FINGERS)
def comparison(request: pytest.FixtureRequest) -> Results:
    return compared(FINGERS[request.param])


@pytest.fixture(scope="module")
def pages(comparison: Results) -> dict[str, Page]:
    names = ("overlay", "von_mises", "mesh", "design", "marker_errors")
    return {name: page_of(draw(comparison, name).figure) for name in names}


def test_no_type_runs_into_other_type_or_leaves_the_page(pages):
    for name, page in pages.items():
        assert (name, page.cut_off(), page.overlaps()) == (name, [], [])
        assert page.figure.get_figheight() < 11


def test_the_drawing_of_a_design_has_the_papers_parameters(comparison, pages):
    facts = [value for _, symbol, value in comparison.design.facts() if symbol]
    assert len(facts) == (9 if comparison.design.name == "csiro" else 0)
    assert [value for value in facts if f" {value}" not in pages["design"].text] == []
    assert all(str(number + 1) in pages["design"].text for number in range(len(comparison.design.markers)))


def test_notes_and_scale_bars_do_not_lie_on_the_body(comparison, pages):
    """Neither undeformed nor, in the overlay, deformed."""
    deformed = [comparison.mesh.points + each.node_displacement for each in comparison.evaluations]
    for name in ("overlay", "von_mises"):
        notes = [
            (axes, text)
            for axes in pages[name].figure.axes
            for text in axes.texts
            if text.get_text().startswith(("MAE", "largest", "rel.")) or text.get_text().endswith(" mm")
        ]
        assert notes
        for axes, text in notes:
            box = text.get_window_extent()
            for cloud in [comparison.mesh.points, *(deformed if name == "overlay" else [])]:
                covered = [point for point in axes.transData.transform(cloud) if box.contains(*point)]
                assert (name, text.get_text(), covered) == (name, text.get_text(), [])


def test_the_base_is_hatched_along_each_of_its_parts(comparison, pages):
    """Hatches start on a clamped piece of the section and lead out of the body."""
    (axes, *_) = pages["overlay"].figure.axes
    hatches = [
        np.array(lines.get_segments())
        for lines in axes.collections
        if isinstance(lines, LineCollection) and lines.get_zorder() == 0.5
    ]
    section = comparison.design.section
    pieces = [loop.along(which, np.linspace(0, 1, 401)) for loop, which in section.named("base")]
    assert len(hatches) == len(pieces)
    for strokes in hatches:
        away = [np.linalg.norm(strokes[:, :1] - piece, axis=2).min(axis=1).max() for piece in pieces]
        assert min(away) < 0.3
        assert section.clearance(strokes[:, 1]).max() < 0


def test_a_cylinder_stands_on_a_curved_front() -> None:
    """Its motion starts on the ring, not on y = 0."""
    found = compared(ring())
    aside = replace(
        found, load=found.load.model_copy(update={"kind": "cylinder", "radius": 5.0, "position": 35.0})
    )
    axes, *_ = draw(aside, "overlay").figure.axes
    starts = [text.xyann for text in axes.texts if not text.get_text()]  # type: ignore[attr-defined]
    height = float(ring().section.front_point(35.0)[1])
    assert min(abs(y - height) for _, y in starts) < 0.05
