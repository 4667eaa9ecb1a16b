"""Fields of every solver on one colour scale, each with its differences."""

from collections.abc import Callable, Collection
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes

from pinnray.comparison.evaluation.comparison import TRUTH, Results
from pinnray.comparison.evaluation.differences import COMPONENTS, relative_l2
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.figures import body
from pinnray.comparison.figures.body import DIVERGING, ColourScale, sequential, symmetric
from pinnray.comparison.figures.canvas import Canvas
from pinnray.comparison.figures.layout import TALLEST, axes_at, fitting, write_heading
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.runtime.figure import NARROW, WIDTH, Figure, figure
from pinnray.runtime.tables import percent, significant
from pinnray.solvers.shared_work import shared

MARGIN = 0.1
HEAD, PANEL_TITLE, FOOT = 0.3, 0.2, 0.55
"""Heights in inches: heading; the name above a panel; the colour bars."""


class FieldQuantity(NamedTuple):
    """A scalar field to draw."""

    name: str  # file name without suffix
    title: str
    unit: str  # `MPa` or `%`
    signed: bool  # whether its scale is symmetric about zero; else it starts there
    values: Callable[[Evaluation], FloatArray]  # the field at the quadrature points, shape (q,)


def max_principal(strain: FloatArray) -> FloatArray:
    """The larger in-plane principal value of symmetric tensors of shape (q, 2, 2), shape (q,)."""
    mean = (strain[:, 0, 0] + strain[:, 1, 1]) / 2
    return np.asarray(mean + np.hypot((strain[:, 0, 0] - strain[:, 1, 1]) / 2, strain[:, 0, 1]))


def _strain_component(component: str) -> FieldQuantity:
    row, column = COMPONENTS[component]
    name, title = f"strain_{component}", f"Strain component {component}"
    return FieldQuantity(name, title, "%", True, lambda each: 100 * each.strain[:, row, column])


QUANTITIES = (
    FieldQuantity("von_mises", "Von Mises stress", "MPa", False, lambda each: each.von_mises),
    FieldQuantity(
        "strain_principal",
        "Largest in-plane principal strain",
        "%",
        False,
        lambda each: 100 * max_principal(each.strain),
    ),
    *map(_strain_component, ("xx", "yy", "xy")),
)


DISPLACEMENT = FieldQuantity(
    "displacement", "Displacement magnitude", "mm", False, lambda each: np.hypot(*each.displacement.T)
)

VIEWED = (DISPLACEMENT, *QUANTITIES)
"""Quantities to choose from where one at a time is shown."""


def triangle_values(quantity: FieldQuantity, evaluation: Evaluation) -> FloatArray:
    """Mean of the quantity over each triangle, shape (t,), as it is drawn."""
    return evaluation.per_triangle(quantity.values(evaluation))


def field_scale(quantity: FieldQuantity, mesh: TriangleMesh, reference: Evaluation) -> ColourScale:
    """The scale that every solver's field is drawn on: it covers the percentile of the reference's area."""
    values = triangle_values(quantity, reference)
    return symmetric(values, mesh.areas) if quantity.signed else sequential(values, mesh.areas)


def compared_with(comparison: Results) -> Evaluation:
    """The field from which differences are drawn: the truth where it is known, else the reference."""
    return next((each for each in comparison.shown_fields if each.solver == TRUTH), comparison.reference)


def drawn_solvers(
    comparison: Results, solvers: Collection[str] = (), page: float = WIDTH
) -> list[Evaluation]:
    """The fields that a picture has room for: what they are compared with, the reference, then the others.

    Those that converged come before those that did not. `solvers` are the chosen ones; all if empty.

    Raises:
        UserError: If one of them is no solver of the comparison.
    """
    base = compared_with(comparison)
    known = [each for each in comparison.shown_fields if each.solver != base.solver]
    names = [each.solver for each in known]
    if unknown := [name for name in solvers if name not in names and name != base.solver]:
        raise UserError(f"no field of this comparison is called {unknown[0]!r}; it has {', '.join(names)}")
    columns, width = _columns(comparison, page)
    extent = body.field_extent(comparison.mesh, width)
    panels = int((TALLEST - HEAD - FOOT) / (PANEL_TITLE + width * extent.height / extent.width)) * columns
    room = (panels - 1) // 2 if columns == 1 else panels // 2 - 1
    chosen = fitting(known, comparison.reference, room, solvers)
    chosen.sort(key=lambda each: (each.solver != comparison.reference.solver, not each.converged))
    return [base, *chosen]


def draw_field(
    comparison: Results, quantity: FieldQuantity, solvers: Collection[str] = (), page: float = WIDTH
) -> Figure:
    """Draw a quantity on the undeformed body: a row a solver, beside it its difference from the first row.

    The first row is the truth where the markers are simulated, else the reference. See `drawn_solvers` for
    the others. On a narrow page, of a width in inches, a difference is below its field.
    """
    mesh, ordered = comparison.mesh, drawn_solvers(comparison, solvers, page)
    reference = ordered[0]
    columns, width = _columns(comparison, page)
    extent = body.field_extent(mesh, width)
    row = PANEL_TITLE + width * extent.height / extent.width
    scale = field_scale(quantity, mesh, reference)
    panels = [0, *range(columns, columns + 2 * len(ordered) - 2)]  # the reference has no difference
    rows = -(-(panels[-1] + 1) // columns)
    bars = min(len(ordered), 2)
    total = HEAD + rows * row + FOOT * (1 if columns == 2 else bars)
    base = quantity.values(reference)
    largest = "largest magnitude" if quantity.signed else "largest"
    places = iter(divmod(panel, columns) for panel in panels)

    def next_axes() -> Axes:
        place, column = next(places)
        box = (MARGIN + column * (width + MARGIN), HEAD + PANEL_TITLE + place * row, width, row - PANEL_TITLE)
        return axes_at(drawn, box)

    canvas = shared((mesh.digest, extent), lambda: Canvas(mesh, extent, width=body.PIXELS // 2))
    with figure(total, page) as drawn:
        write_heading(drawn, f"{quantity.title}, undeformed")
        for evaluation in ordered:
            values = quantity.values(evaluation)
            means = evaluation.per_triangle(values)
            name = _name(evaluation)
            note = f"{largest} {significant(np.abs(means).max(), 3)} {quantity.unit}"
            body.panel(axes := next_axes(), canvas, mesh, scale.paint(means), name, note)
            if evaluation is not reference:
                difference = evaluation.per_triangle(values - base)
                own = symmetric(difference, mesh.areas)  # or a near solver would be blank beside a far one
                distance = percent(relative_l2(values, base, reference.weights), 2)
                title = f"minus {reference.solver}, ±{significant(own.high, 2)} {quantity.unit}"
                colours, said = own.paint(difference), f"rel. L² {distance}"
                body.panel(axes := next_axes(), canvas, mesh, colours, title, said, bold=False)
        body.scale_bar(axes, extent)
        differences = ColourScale(-1.0, 1.0, mpl.colormaps[DIVERGING])
        legends = [
            (scale, f"{quantity.title}, {quantity.unit}", "both" if quantity.signed else "max"),
            (differences, "difference, share of the panel’s scale", "both"),
        ]
        for number, (each, title, extend) in enumerate(legends[:bars]):
            place, column = divmod(number, columns)
            left = MARGIN + column * (width + MARGIN) + 0.1 * width
            axes = axes_at(drawn, (left, HEAD + rows * row + place * FOOT + 0.1, 0.8 * width, 0.09))
            body.colour_bar(axes, each, title, extend=extend)
    return drawn


def _columns(comparison: Results, page: float) -> tuple[int, float]:
    """Number of columns of panels on a page of a width, and width of a panel, inches."""
    columns = 1 if page < NARROW or len(comparison.shown_fields) == 1 else 2
    return columns, (page - MARGIN * (columns + 1)) / columns


def _name(evaluation: Evaluation) -> str:
    return f"{evaluation.label}, simulated" if evaluation.solver == TRUTH else evaluation.label
