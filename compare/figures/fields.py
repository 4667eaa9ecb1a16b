"""A scalar field of every solver on one colour scale, with the differences from the reference beside it."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from compare.evaluation.comparison import Comparison
from compare.evaluation.differences import field_difference
from compare.evaluation.evaluation import Evaluation
from compare.evaluation.metrics import COMPONENTS
from compare.evaluation.number_format import percent, significant
from compare.figures import body
from compare.figures.canvas import Canvas
from compare.figures.colours import PERCENT, Scale, sequential, symmetric
from compare.figures.style import axes_at, heading
from geometry.arrays import FloatArray
from geometry.figure import MUTED, WIDTH, Figure, figure
from geometry.mesh.boundary import boundary_edges
from geometry.mesh.triangle_mesh import TriangleMesh

MARGIN = 0.1
HEAD, PANEL_TITLE, FOOT = 0.3, 0.2, 0.55
"""Heights in inches: heading; the name above a panel; the colour bars."""


class Quantity(NamedTuple):
    """A scalar field to draw.

    Attributes:
        name: File name without suffix.
        title: What the heading calls it.
        symbol: For the colour bar, in mathematical notation without the dollar signs.
        unit: `MPa` or `%`.
        signed: Whether its scale is symmetric about zero; else it starts there.
        values: From an evaluation to the field at the quadrature points, shape (q,).
    """

    name: str
    title: str
    symbol: str
    unit: str
    signed: bool
    values: Callable[[Evaluation], FloatArray]


def max_principal(strain: FloatArray) -> FloatArray:
    """The larger in-plane principal value of symmetric tensors of shape (q, 2, 2), shape (q,)."""
    mean = (strain[:, 0, 0] + strain[:, 1, 1]) / 2
    return np.asarray(mean + np.hypot((strain[:, 0, 0] - strain[:, 1, 1]) / 2, strain[:, 0, 1]))


def strain_percent(component: str) -> Callable[[Evaluation], FloatArray]:
    """The function that gives one strain component, `xx`, `yy` or `xy`, in percent."""
    row, column = COMPONENTS[component]
    return lambda evaluation: 100 * evaluation.strain[:, row, column]


QUANTITIES = (
    Quantity("von_mises", "Von Mises stress", r"\sigma_\mathrm{vM}", "MPa", False, lambda e: e.von_mises),
    Quantity(
        "strain_principal",
        "Largest in-plane principal strain",
        r"\varepsilon_1",
        "%",
        False,
        lambda e: 100 * max_principal(e.strain),
    ),
    Quantity("strain_xx", "Strain component xx", r"\varepsilon_{xx}", "%", True, strain_percent("xx")),
    Quantity("strain_yy", "Strain component yy", r"\varepsilon_{yy}", "%", True, strain_percent("yy")),
    Quantity("strain_xy", "Strain component xy", r"\varepsilon_{xy}", "%", True, strain_percent("xy")),
)


def triangle_values(quantity: Quantity, evaluation: Evaluation) -> FloatArray:
    """Mean of the quantity over each triangle, shape (t,), as it is drawn."""
    return evaluation.per_triangle(quantity.values(evaluation))


def field_scale(quantity: Quantity, mesh: TriangleMesh, reference: Evaluation) -> Scale:
    """The scale that every solver's field is drawn on: it covers the percentile of the reference's area."""
    values = triangle_values(quantity, reference)
    return symmetric([values], mesh.areas) if quantity.signed else sequential(values, mesh.areas)


def difference_scale(
    quantity: Quantity, mesh: TriangleMesh, evaluations: Sequence[Evaluation], reference: Evaluation
) -> Scale:
    """The scale of every difference: it covers the percentile in each solver that converged (or in all).

    It ends at most where that of the field does, lest one solver that is far away takes all colours.
    """
    others = [evaluation for evaluation in evaluations if evaluation is not reference]
    chosen = [evaluation for evaluation in others if evaluation.converged] or others
    base = triangle_values(quantity, reference)
    found = symmetric([triangle_values(quantity, evaluation) - base for evaluation in chosen], mesh.areas)
    limit = min(found.high, field_scale(quantity, mesh, reference).high)
    return found._replace(low=-limit, high=limit)


def draw_field(comparison: Comparison, quantity: Quantity) -> Figure:
    """Draw a quantity on the undeformed body: a row a solver, its difference from the reference beside it."""
    mesh, reference = comparison.mesh, comparison.reference
    ordered = [
        reference,
        *(evaluation for evaluation in comparison.evaluations if evaluation is not reference),
    ]
    columns = 1 if len(ordered) == 1 else 2
    width = (WIDTH - MARGIN * (columns + 1)) / columns
    extent = body.field_extent(mesh)
    height = width * extent.height / extent.width
    scale = field_scale(quantity, mesh, reference)
    differences = difference_scale(quantity, mesh, ordered, reference)
    total = HEAD + len(ordered) * (PANEL_TITLE + height) + FOOT
    edges = boundary_edges(mesh.triangles)
    base = quantity.values(reference)
    size = f"$|{quantity.symbol}|$" if quantity.signed else f"${quantity.symbol}$"

    def panel(row: int, column: int, colours: Scale, values: FloatArray, of: Evaluation) -> Axes:
        left, top = MARGIN + column * (width + MARGIN), HEAD + PANEL_TITLE + row * (PANEL_TITLE + height)
        axes = axes_at(drawn, (left, top, width, height))
        body.prepare(axes, extent)
        body.show(axes, canvas.picture(colours.paint(of.per_triangle(values))), extent)
        body.outline(axes, edges, mesh.points, width=0.35)
        return axes

    with figure(total) as drawn, Canvas(mesh, extent, width=body.PIXELS // 2) as canvas:
        heading(drawn, f"{quantity.title}, undeformed body")
        for row, evaluation in enumerate(ordered):
            values = quantity.values(evaluation)
            axes = panel(row, 0, scale, values, evaluation)
            axes.set_title(evaluation.label, size=8.5, pad=2, weight="bold")
            largest = np.abs(evaluation.per_triangle(values)).max()
            _remark(axes, f"largest {size} = {significant(largest, 3)} {quantity.unit}")
            if evaluation is not reference:
                axes = panel(row, 1, differences, values - base, evaluation)
                norm = field_difference(values, base, reference.weights).rel_l2
                axes.set_title(f"minus {reference.label}", size=8.5, pad=2)
                _remark(axes, f"rel. $L^2$ {percent(norm)}")
            elif columns == 2:
                _explain(drawn, (2 * MARGIN + width, HEAD + PANEL_TITLE, width, height), reference)
        body.scale_bar(axes, extent)
        _bars(drawn, quantity, scale, differences, columns, width, total)
    return drawn


def _remark(axes: Axes, text: str) -> None:
    """A number in the corner below the tip, which no finger fills, above the scale bar."""
    axes.text(0.99, 0.33, text, ha="right", size=7, color=MUTED, transform=axes.transAxes)


def _explain(drawn: Figure, box: tuple[float, float, float, float], reference: Evaluation) -> None:
    axes = axes_at(drawn, box)
    axes.set_axis_off()
    text = (
        f"Reference: {reference.label}\n"
        f"Scales end at the {PERCENT:g} % point of the area\n"
        "(left: of the reference; right: of differences,\nat most as left). Values beyond take the end\n"
        "colours. Largest: of the means over a triangle."
    )
    axes.text(0.02, 0.95, text, va="top", size=7, color=MUTED, linespacing=1.35, transform=axes.transAxes)


def _bars(
    drawn: Figure,
    quantity: Quantity,
    scale: Scale,
    differences: Scale,
    columns: int,
    width: float,
    total: float,
) -> None:
    inset = 0.1 * width
    for column, (colours, title) in enumerate(
        [
            (scale, f"${quantity.symbol}$, {quantity.unit}"),
            (differences, f"difference of ${quantity.symbol}$, {quantity.unit}"),
        ][:columns]
    ):
        left = MARGIN + column * (width + MARGIN) + inset
        axes = axes_at(drawn, (left, total - FOOT + 0.1, width - 2 * inset, 0.09))
        body.colour_bar(axes, colours, title, extend="max" if column == 0 and not quantity.signed else "both")
