"""Density of the energy by which each solver is above finite elements."""

from collections.abc import Sequence

import matplotlib as mpl
import numpy as np

from compare.evaluation.certificate import Certificate
from compare.evaluation.comparison import Comparison
from compare.evaluation.differences import weighted_percentile
from compare.evaluation.evaluation import Evaluation
from compare.evaluation.number_format import percent
from compare.figures import body
from compare.figures.canvas import Canvas
from compare.figures.colours import PERCENT, Scale
from compare.figures.style import axes_at, heading
from geometry.arrays import FloatArray
from geometry.figure import MUTED, WIDTH, Figure, figure
from geometry.mesh.boundary import boundary_edges
from geometry.mesh.triangle_mesh import TriangleMesh

MARGIN = 0.1
HEAD, PANEL_TITLE, FOOT = 0.3, 0.2, 0.55
"""Heights in inches: heading; the name above a panel; the colour bar."""

DECADES = 4
"""Powers of ten on the colour scale."""


def excesses(evaluations: Sequence[Evaluation]) -> list[tuple[str, Certificate]]:
    """Label and certificate of every solver that has an excess."""
    return [
        (evaluation.label, evaluation.certificate)
        for evaluation in evaluations
        if evaluation.certificate is not None and evaluation.certificate.has_excess
    ]


def excess_scale(mesh: TriangleMesh, densities: Sequence[FloatArray]) -> Scale:
    """The logarithmic scale that every solver shares; it ends at the highest percentile of any of them."""
    high = max(weighted_percentile(density, mesh.areas, PERCENT) for density in densities)
    return Scale(high / 10**DECADES, high, mpl.colormaps["viridis"], log=True)


def draw_excess(comparison: Comparison) -> Figure | None:
    """Draw the density of the excess energy of every solver that has one; None if none has."""
    mesh, entries = comparison.mesh, excesses(comparison.evaluations)
    if not entries:
        return None
    columns = min(len(entries), 2)
    rows = -(-len(entries) // columns)
    width = (WIDTH - MARGIN * (columns + 1)) / columns
    extent = body.field_extent(mesh)
    height = width * extent.height / extent.width
    scale = excess_scale(mesh, [certificate.density for _, certificate in entries])
    edges = boundary_edges(mesh.triangles)
    total = HEAD + rows * (PANEL_TITLE + height) + FOOT
    with figure(total) as drawn, Canvas(mesh, extent, width=body.PIXELS // 2) as canvas:
        heading(drawn, "Excess energy over finite elements, undeformed body")
        for number, (label, certificate) in enumerate(entries):
            row, column = divmod(number, columns)
            top = HEAD + PANEL_TITLE + row * (PANEL_TITLE + height)
            axes = axes_at(drawn, (MARGIN + column * (width + MARGIN), top, width, height))
            body.prepare(axes, extent)
            colours = scale.paint(np.maximum(certificate.density, scale.low))
            body.show(axes, canvas.picture(colours), extent)
            body.outline(axes, edges, mesh.points, width=0.35)
            axes.set_title(label, size=8.5, pad=2, weight="bold")
            note = f"{percent(certificate.rel_excess, 2)} of the energy"
            axes.text(0.99, 0.33, note, ha="right", size=7, color=MUTED, transform=axes.transAxes)
        body.scale_bar(axes, extent)
        bar = axes_at(drawn, (0.2 * WIDTH, total - FOOT + 0.1, 0.6 * WIDTH, 0.09))
        body.colour_bar(bar, scale, "density of the excess energy, MPa", extend="both")
    return drawn
