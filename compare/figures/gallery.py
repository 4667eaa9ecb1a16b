"""The pictures of a comparison by name, in the order of the report, with their captions."""

from collections.abc import Callable, Collection, Sequence
from functools import partial
from typing import NamedTuple

from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.evaluation.evaluation import IN_SAMPLE, Evaluation
from pinnray.comparison.evaluation.force_curves import ForceCurve, force_curves
from pinnray.comparison.figures.body import PERCENT
from pinnray.comparison.figures.fields import QUANTITIES, FieldQuantity, draw_field, drawn_solvers
from pinnray.comparison.figures.force_charts import draw_force_displacement
from pinnray.comparison.figures.overlay import Panels, draw_overlay
from pinnray.comparison.figures.solver_charts import draw_losses, draw_marker_errors
from pinnray.runtime.errors import UserError
from pinnray.runtime.figure import NARROW, WIDTH, Figure


class Illustration(NamedTuple):
    """A picture with the words of `pinnray.comparison.figures.Picture`."""

    figure: Figure
    title: str
    caption: str


def _overlay(comparison: Results, page: float) -> Illustration:
    absent = _absent(comparison.evaluations, Panels.on(comparison, page).solvers)
    said = f"Displacement magnitude on one scale, not exaggerated.{absent}"
    return Illustration(draw_overlay(comparison, page), "Deformed finger", said)


def _marker_errors(comparison: Results, page: float) -> Illustration | None:
    observations = comparison.observations
    if not observations.known:
        return None
    unseen = "" if observations.visible.all() else " ×: a marker that was not seen."
    said = f"On one logarithmic scale, numbered as in the design.{unseen}"
    return Illustration(draw_marker_errors(comparison, page), "Errors at the markers", said)


def _field(
    comparison: Results, page: float, quantity: FieldQuantity, solvers: Collection[str] = ()
) -> Illustration:
    drawn = drawn_solvers(comparison, solvers, page)
    reference = drawn[0].label
    caption = "Drawn as the von Mises stress."
    if quantity is QUANTITIES[0]:
        caption = (
            f"One scale, which covers {PERCENT:g} % of the area in {reference}; at sharp corners the largest "
            "value grows with refinement."
        )
        if len(comparison.shown_fields) > 1:
            where = "Below" if page < NARROW else "Right"
            caption += f" {where}: the field minus {reference}, each on the scale above its panel."
        caption += _absent(comparison.shown_fields, drawn)
    return Illustration(draw_field(comparison, quantity, solvers, page), quantity.title, caption)


def _force_displacement(comparison: Results, page: float) -> Illustration | None:
    depth, truth = comparison.design.depth, None
    if not (curves := force_curves(comparison.evaluations, comparison.load)):
        return None
    said = "Points: equilibria that a solver found as the load grew. Dashed: straight by the linear law."
    if comparison.truth is not None:
        truth = ForceCurve.of(comparison.truth, comparison.load)
        said += " Pink: the truth."
    if found := [each for each in comparison.evaluations if each.identified]:
        said += " Squares: forces found from the markers, with intervals of 95 %."
    figure = draw_force_displacement(curves, depth=depth, truth=truth, identified=found, page=page)
    return Illustration(figure, "Force over displacement", said)


def _losses(comparison: Results, page: float) -> Illustration | None:
    if (figure := draw_losses(comparison, page)) is None:
        return None
    given = f" {IN_SAMPLE}." if any(each.in_sample for each in comparison.evaluations) else ""
    return Illustration(
        figure,
        "Losses",
        f"As Fig. 7 of the paper. L_PDE is the mean energy density, whose least value is not zero: markers "
        f"cannot lower it at convergence, and the lower one is not the more accurate. A curve that still "
        f"falls is a training that has not ended.{given}",
    )


def _design(comparison: Results, page: float) -> Illustration:
    said = "To scale: clamped base (hatched), contact (orange), numbered markers."
    return Illustration(comparison.design.plot(page), "Design", said)


def _mesh(comparison: Results, page: float) -> Illustration:
    return Illustration(comparison.mesh.plot(page), "Mesh", "Shared by every solver.")


CHOOSING = tuple(each.name for each in QUANTITIES)
"""Pictures in which solvers can be chosen."""

GALLERY: dict[str, tuple[str, Callable[..., Illustration | None]]] = {
    **{each.name: (f"picture of {each.name}", partial(_field, quantity=each)) for each in QUANTITIES},
    "overlay": ("picture of the deformed finger", _overlay),
    "marker_errors": ("chart of the errors at the markers", _marker_errors),
    "force_displacement": ("chart of force over displacement", _force_displacement),
    "design": ("drawing of the design", _design),
    "mesh": ("picture of the mesh", _mesh),
    "losses": ("chart of the losses", _losses),
}
"""By file name: words for the progress line, and the function; it gives None if there is nothing to draw."""


def draw(comparison: Results, name: str, solvers: Collection[str] = (), page: float = WIDTH) -> Illustration:
    """One picture of a comparison by its name; a picture of fields may have chosen solvers only.

    The page has a width in inches.

    Raises:
        UserError: If there is no such picture or solver, or nothing to draw in it.
    """
    if name not in GALLERY:
        raise UserError(f"there is no picture {name!r}; there are {', '.join(GALLERY)}")
    what, make = GALLERY[name]
    if solvers and name not in CHOOSING:
        raise UserError(f"the {what} has all solvers; chosen ones are for {', '.join(CHOOSING)}")
    if (drawing := make(comparison, page, solvers=solvers) if solvers else make(comparison, page)) is None:
        raise UserError(f"{name}: no solver of this comparison has data for the {what}")
    return drawing


def _absent(every: Sequence[Evaluation], drawn: Sequence[Evaluation]) -> str:
    """The solvers that a picture does not have, if there are any."""
    names = {each.solver for each in drawn}
    absent = [each.label for each in every if each.solver not in names]
    return f" Left out: {', '.join(absent)}." if absent else ""
