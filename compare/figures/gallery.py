"""The pictures of a comparison by name, in the order of the report, with their captions."""

from collections.abc import Callable, Collection, Iterable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.evaluation.evaluation import IN_SAMPLE, Evaluation
from pinnray.comparison.evaluation.force_curves import ForceCurve, force_curves
from pinnray.comparison.figures.body import PERCENT
from pinnray.comparison.figures.fields import QUANTITIES, FieldQuantity, draw_field, drawn_solvers
from pinnray.comparison.figures.force_charts import draw_force_displacement
from pinnray.comparison.figures.mesh_drawing import draw_mesh, mesh_numbers
from pinnray.comparison.figures.overlay import Panels, draw_overlay
from pinnray.comparison.figures.solver_charts import draw_losses, draw_marker_errors
from pinnray.runtime.errors import UserError
from pinnray.runtime.figure import NARROW, WIDTH, Figure


class Illustration(NamedTuple):
    """A picture with the words of `pinnray.comparison.figures.Picture`."""

    figure: Figure
    title: str
    caption: str
    alt: str


def _overlay(comparison: Results, page: float) -> Illustration:
    observations = comparison.observations
    cylinder = "" if comparison.load.radius is None else " Grey circle: the cylinder where it ends."
    circles = f"Circles: {observations.label} marker positions. " if observations.known else ""
    if observations.known:
        circles += (
            "Pink arrows: errors there, times the factor above the panel, of held-out markers if known. "
        )
    return Illustration(
        draw_overlay(comparison, page),
        "Deformed finger",
        f"The deformed body of each solver, coloured by displacement magnitude on one scale; the "
        f"displacement is not exaggerated. {circles}Crosses: the solver’s markers. "
        f"Grey: the undeformed body.{cylinder}{_given(comparison)}"
        f"{_absent(comparison.evaluations, Panels.on(comparison, page).solvers)}",
        each_of(
            "Largest displacement, mm",
            comparison.evaluations,
            lambda each: float(np.hypot(*each.node_displacement.T).max()),
        ),
    )


def _marker_errors(comparison: Results, page: float) -> Illustration | None:
    observations = comparison.observations
    if not observations.known:
        return None
    hidden = int((~observations.visible).sum())
    unseen = (
        f" {hidden} of {len(observations.visible)} markers (×) were not seen and count nowhere."
        if hidden
        else ""
    )
    return Illustration(
        draw_marker_errors(comparison, page),
        "Errors at the markers",
        f"Absolute difference between each solver’s displacement and the {observations.label} one, "
        f"for both components, on one logarithmic scale; smaller errors are at its lower end. Markers are "
        f"numbered as in the drawing of the design. Bars: at a marker that the solver was not given, "
        f"predicted from all others if it was given those. Circles: training errors."
        f"{unseen}{_given(comparison)}",
        each_of(
            "Mean of |Δu| + |Δv| at markers that were not given, mm",
            comparison.evaluations,
            lambda each: getattr(comparison.scores[each.solver].held_out, "mae_sum", float("nan")),
        ),
    )


def _field(
    comparison: Results, page: float, quantity: FieldQuantity, solvers: Collection[str] = ()
) -> Illustration:
    drawn = drawn_solvers(comparison, solvers, page)
    reference = drawn[0].label
    mixed = (
        " The solvers have different laws: strain is Green-Lagrange where it is finite, stress is Cauchy."
        if len({evaluation.law for evaluation in comparison.shown_fields}) > 1
        else ""
    )
    where = "Below" if page < NARROW else "Right"
    beside = (
        f" {where}: the field minus that of {reference}, point by point; each on a scale of its own, which "
        f"ends at the same share of the area and is stated above the panel: compare numbers, not colours."
        if len(comparison.shown_fields) > 1
        else ""
    )
    if comparison.truth is not None:
        beside += " Truth: the simulated finger of the markers."
    beside += _absent(comparison.shown_fields, drawn)
    return Illustration(
        draw_field(comparison, quantity, solvers, page),
        quantity.title,
        f"{quantity.title}, drawn as the {QUANTITIES[0].title}."
        if quantity is not QUANTITIES[0]
        else f"{quantity.title} by each solver on the undeformed body, each triangle in the colour of its "
        f"mean. One scale for all: {PERCENT:g} % of the area of {reference} lie "
        f"within it, the peaks at the corners take the end colours. At a sharp corner the field has no "
        f"bound: the largest mean of a triangle, printed below, grows with refinement.{beside}{mixed}",
        each_of(
            f"Mean size over the body, {quantity.unit}",
            comparison.shown_fields,
            lambda each: float(np.average(np.abs(quantity.values(each)), weights=each.weights)),
        ),
    )


def _force_displacement(comparison: Results, page: float) -> Illustration | None:
    depth = comparison.design.depth
    if not (curves := force_curves(comparison.evaluations, comparison.load)):
        return None
    truth, cross = None, ""
    if comparison.truth is not None:
        truth = ForceCurve.of(comparison.truth, comparison.load)
        cross = " Pink: the force on the simulated finger, the truth that the solvers should reach."
    found = {n: each for n, each in enumerate(comparison.evaluations) if each.identified}
    squares = " Squares: forces identified from the markers, with intervals of 95 %." if found else ""
    return Illustration(
        draw_force_displacement(curves, depth=depth, truth=truth, identified=found, page=page),
        "Force over displacement",
        f"Force of the indenter along its stroke: per mm of depth (left), and for the finger’s "
        f"{depth:g} mm (right). A point is an equilibrium that a solver found as the load "
        f"grew; a linear solver’s line (dashed) is straight by its law. Other solvers that were given "
        f"the markers are left out: the markers pull too.{cross}{squares}",
        each_of(
            f"Force at the end of the stroke of {curves[0].stroke[-1]:g} mm, N per mm",
            [curve.evaluation for curve in curves],
            lambda each: ForceCurve.of(each, comparison.load).force[-1],
        ),
    )


def _losses(comparison: Results, page: float) -> Illustration | None:
    if (figure := draw_losses(comparison, page)) is None:
        return None
    return Illustration(
        figure,
        "Losses",
        f"The paper’s Fig. 7, for all terms of the loss. L_PDE is the mean energy density: its least "
        f"value is not zero, and where the conditions are met, every further one raises it. So markers "
        f"cannot lower it at convergence. A network with the lower L_PDE at some epoch has come farther "
        f"in its training or misses its conditions by more, which L_BC tells; it is no more accurate for "
        f"it. A curve that still falls is a training that has not ended.{_given(comparison)}",
        each_of(
            "Last L_PDE",
            [each for each in comparison.evaluations if "PDE" in each.history],
            lambda each: float(each.history["PDE"][-1]),
        ),
    )


def _design(comparison: Results, page: float) -> Illustration:
    finger = comparison.design
    return Illustration(
        finger.plot(page),
        "Design",
        f"The finger “{finger.name}”, to scale: clamped base (hatched), contact (orange), numbered markers.",
        "; ".join(f"{name} {value}" for name, _, value in finger.facts()),
    )


def _mesh(comparison: Results, page: float) -> Illustration:
    numbers = mesh_numbers(comparison.mesh)
    return Illustration(
        draw_mesh(comparison.mesh, page),
        "Mesh",
        f"The mesh that every solver shares: {numbers['size']}, edges from {numbers['edges']}. Quality is "
        f"twice the ratio of the inscribed to the circumscribed radius (1 for an equilateral triangle): "
        f"{numbers['quality']}. Orange: the contact. Dots: the markers.",
        f"{numbers['size']}, edges from {numbers['edges']}",
    )


CHOOSING = tuple(each.name for each in QUANTITIES)
"""Pictures in which solvers can be chosen."""

GALLERY: dict[str, tuple[str, Callable[..., Illustration | None]]] = {
    "overlay": ("picture of the deformed finger", _overlay),
    "marker_errors": ("chart of the errors at the markers", _marker_errors),
    **{each.name: (f"picture of {each.name}", partial(_field, quantity=each)) for each in QUANTITIES},
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


def each_of(quantity: str, evaluations: Iterable[Evaluation], value: Callable[[Evaluation], float]) -> str:
    """A quantity of every evaluation in words."""
    return f"{quantity}: {', '.join(f'{each.label} {value(each):.3g}' for each in evaluations)}."


def _absent(every: Sequence[Evaluation], drawn: Sequence[Evaluation]) -> str:
    """The solvers that a picture does not have, if there are any."""
    names = {each.solver for each in drawn}
    absent = [each.label for each in every if each.solver not in names]
    if not absent:
        return ""
    return f" Not drawn, as a page has no more room or others were chosen: {', '.join(absent)}."


def _given(comparison: Results) -> str:
    """The meaning of the mark beside a solver's name, if there is one."""
    return f" {IN_SAMPLE}." if any(evaluation.in_sample for evaluation in comparison.evaluations) else ""
