"""The deformed finger of every solver, with its markers and those that were seen."""

from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.evaluation.scores import SolverScores
from pinnray.comparison.figures import body, layout
from pinnray.comparison.figures.body import SEQUENTIAL, ColourScale
from pinnray.comparison.figures.canvas import Canvas, Extent
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.observations import Observations
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.figure import INK, MEASURED, MUTED, NARROW, SMALL, WIDTH, Figure, figure
from pinnray.solvers.problem import Problem, contact_ends, front_points

MARGIN = 0.12
PANEL_TITLE, FOOT = 0.27, 0.48
"""Heights in inches: the name above a panel; the colour bar."""


class Panels(NamedTuple):
    """The panels that a page has room for."""

    columns: int
    width: float  # inches
    extent: Extent  # of each
    solvers: list[Evaluation]

    @classmethod
    def on(cls, comparison: Results, page: float) -> "Panels":
        """Those on a page of a width, inches: in one column if it is narrow or they all fit, else in two."""
        count, columns = len(comparison.evaluations), 1
        while True:
            width = (page - MARGIN * (columns + 1)) / columns
            extent = overlay_extent(comparison, width)
            row = PANEL_TITLE + width * extent.height / extent.width
            room = int((layout.TALLEST - _head(comparison, page) - FOOT) / row) * columns
            if columns == min(2, count) or page < NARROW or count <= min(3, room):
                break
            columns = 2
        return cls(columns, width, extent, layout.fitting(comparison.evaluations, comparison.reference, room))


def draw_overlay(comparison: Results, page: float = WIDTH) -> Figure:
    """Draw solvers' deformed fingers, one panel each, at true scale, on a page of a width in inches."""
    mesh = comparison.mesh
    columns, width, extent, evaluations = Panels.on(comparison, page)
    rows = -(-len(evaluations) // columns)
    height = width * extent.height / extent.width
    high = max(float(_magnitude(mesh, evaluation).max()) for evaluation in evaluations)
    scale = ColourScale(0.0, high or 1.0, mpl.colormaps[SEQUENTIAL])
    head = _head(comparison, page)
    total = head + rows * (PANEL_TITLE + height) + FOOT
    canvas = Canvas(mesh, extent, width=body.PIXELS // columns)
    with figure(total, page) as drawn:
        layout.write_heading(drawn, "Deformed finger, true scale")
        for number, evaluation in enumerate(evaluations):
            row, column = divmod(number, columns)
            left = MARGIN + column * (width + MARGIN)
            top = head + PANEL_TITLE + row * (PANEL_TITLE + height)
            axes = layout.axes_at(drawn, (left, top, width, height))
            _panel(axes, canvas, scale, comparison, evaluation)
            _motion(axes, comparison, evaluation)
            body.scale_bar(axes, extent)
        bar = layout.axes_at(drawn, (0.25 * page, total - FOOT + 0.06, 0.5 * page, 0.09))
        body.colour_bar(bar, scale, "displacement magnitude, mm")
        layout.legend_below_heading(drawn, _handles(comparison), length=1.6, note=_note(comparison, page))
    return drawn


def _head(comparison: Results, page: float) -> float:
    """Height of heading, legend and notes, inches."""
    return layout.head_height(page, len(_handles(comparison)), _note(comparison, page))


def _handles(comparison: Results) -> list[Line2D]:
    """The legend."""
    moved = "contact" if comparison.load.radius is None else "cylinder"
    label = f"markers, {comparison.observations.label}"
    seen = [Line2D([], [], ls="", marker="o", ms=5, mfc="none", mec=MEASURED, mew=1.1, label=label)]
    return [
        *(seen if comparison.observations.known else []),
        Line2D([], [], ls="", marker="x", ms=4, color=INK, mew=0.9, label="solver’s markers"),
        Line2D([], [], color="#9a9a9a", lw=0.9, label="undeformed"),
        Line2D([], [], color=INK, lw=1, marker=">", ms=3.5, markevery=[1], label=f"{moved}’s motion"),
    ]


def _note(comparison: Results, page: float) -> str:
    """Notes on marks in the panels, in lines that fit the page."""
    notes = []
    if any(evaluation.in_sample for evaluation in comparison.evaluations):
        notes.append("† was given these markers and meets them; held out: each predicted from the others")
    if comparison.observations.known:
        notes.append("pink arrows: errors at the markers, held out if known, × the factor above the panel")
    return "\n".join(layout.wrapped(note, page) for note in notes)


def overlay_extent(comparison: Results, width: float) -> Extent:
    """The extent of a panel, `width` inches wide, mm.

    It shows the body before and after in every converged solution, and all markers.
    """
    mesh, observations = comparison.mesh, comparison.observations
    seen = observations.visible
    clouds = [mesh.points, observations.points[seen] + observations.displacements[seen]]
    clouds += [
        mesh.points + evaluation.node_displacement
        for evaluation in comparison.evaluations
        if evaluation.converged
    ]
    margin = 0.03 * float(np.ptp(mesh.points, axis=0).max())
    return body.panel_extent(np.concatenate(clouds), width, margin=margin, tallest=4.0)


def _magnitude(mesh: TriangleMesh, evaluation: Evaluation) -> FloatArray:
    size = np.linalg.norm(evaluation.node_displacement, axis=1)
    return np.asarray(size[mesh.triangles].mean(axis=1))


def _panel(
    axes: Axes, canvas: Canvas, scale: ColourScale, comparison: Results, evaluation: Evaluation
) -> None:
    mesh, observations = comparison.mesh, comparison.observations
    deformed = mesh.points + evaluation.node_displacement
    body.prepare(axes, canvas.extent)
    body.draw_outline(axes, canvas.outline, mesh.points, colour="#9a9a9a", width=0.6, zorder=0)
    body.show(axes, canvas, scale.paint(_magnitude(mesh, evaluation)), deformed)
    body.draw_outline(axes, canvas.outline, deformed, width=0.4)
    body.clamp(axes, body.base_lines(mesh), size=body.hatch_size(mesh.points))
    observed = comparison.observed(evaluation)
    computed = observations.points + evaluation.marker_displacement
    axes.plot(*observed.T, "o", ms=5, mfc="none", mec="white", mew=2.0, zorder=4)
    axes.plot(*observed.T, "o", ms=5, mfc="none", mec=MEASURED, mew=1.1, zorder=5)
    axes.plot(*computed.T, "x", ms=4, color="white", mew=2.0, zorder=4)
    axes.plot(*computed.T, "x", ms=4, color=INK, mew=0.9, zorder=5)
    axes.set_title(evaluation.label_at_markers, size=9, pad=3, y=1.0, weight="bold")
    if observations.known:
        _error_vectors(axes, observed, evaluation, observations)
        frame = "" if evaluation.shown is None else "; the frame it found is taken off the markers"
        body.write_note(axes, canvas.extent, errors_note(comparison.scores[evaluation.solver]) + frame)


FACTORS = (1, 2, 5, 10, 20, 50, 100, 200, 500)
"""Magnifications of the errors at the markers."""


def _error_vectors(
    axes: Axes, observed: FloatArray, evaluation: Evaluation, observations: Observations
) -> None:
    """The error at each marker that was seen, from where it was seen, shape (k, 2), mm, and magnified.

    Held out where the solver has such predictions. The longest is a tenth of the panel at most.
    """
    told = evaluation.left_out if evaluation.in_sample else None
    predicted = evaluation.shown_displacement if told is None else told
    error = (predicted - observations.displacements)[observations.visible]
    longest = float(np.linalg.norm(error, axis=1).max())
    room = 0.1 * float(np.ptp(axes.get_xlim()))
    factor = max((each for each in FACTORS if each * longest <= room), default=1)
    style: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1, "color": MEASURED, "zorder": 6}
    head: dict[str, Any] = {"headwidth": 4, "headlength": 4.5, "headaxislength": 4, "minlength": 0.1}
    axes.quiver(*observed.T, *(factor * error).T, units="inches", width=0.014, **style, **head)
    axes.set_title(f"×{factor}", loc="right", size=SMALL, pad=3, y=1.0, color=MEASURED)


def errors_note(own: SolverScores) -> str:
    """Mean absolute errors at the markers in words: held-out ones if the solver has them."""
    errors = own.most_telling
    kind = "" if own.given is None else " held out" if own.held_out else " training"
    return f"MAE{kind}: u {errors.mae_u:.3f}, v {errors.mae_v:.3f} mm"


def contact_motion(comparison: Results, evaluation: Evaluation) -> tuple[FloatArray, FloatArray]:
    """Where the middle of the contact starts and ends, or a cylinder's lowest point, each shape (2,), mm."""
    mesh, load = comparison.mesh, comparison.load
    nodes = np.unique(mesh.boundary("contact"))
    if load.radius is None:
        start = mesh.points[nodes].mean(axis=0)
        return start, start + evaluation.node_displacement[nodes].mean(axis=0)
    start = front_points(mesh, np.array([np.mean(contact_ends(Problem(mesh, load=load)))]))[0]
    return start, start + load.values


def _motion(axes: Axes, comparison: Results, evaluation: Evaluation) -> None:
    """The path of the contact, on average, or of a cylinder, which is drawn where it ends."""
    radius = comparison.load.radius
    start, end = contact_motion(comparison, evaluation)
    if radius is not None:
        centre = (end[0], end[1] + radius)  # it can lie outside the picture
        axes.add_patch(Circle(centre, radius, fill=False, color=MUTED, lw=0.8, zorder=3))
    layout.arrow(axes, start, end)
