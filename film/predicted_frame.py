"""A frame of the pressed finger with the deformed one of every solver over it, as in Fig. 5 of the paper."""

from pathlib import Path

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D

from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.figures import Picture
from pinnray.comparison.figures.layout import axes_at, legend_below_heading, write_heading
from pinnray.comparison.figures.overlay import errors_note
from pinnray.geometry.picture_frame import nearest_similarity
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.figure import COLUMN, INK, MEASURED, PAGE, SMALL, Figure, figure
from pinnray.vision.frames.frame import Frame, Image
from pinnray.vision.tracking.trajectories import Tracking

HEAD, TITLE, GAP = 0.75, 0.36, 0.12
"""Heights in inches: heading and legend, the name above a panel; the gap around panels."""
MARGIN = 0.05
"""Part of the frame around the finger, over the finger's length in it."""
BODY = "#ffd500"
"""Colour of the predicted outline."""
RIM = [patheffects.withStroke(linewidth=1.3, foreground=INK)]
"""Keeps it legible on a light finger, which it hides as little as possible."""


def predicted_frame(folder: Path, comparison: Results, tracking: Tracking, frame: Frame) -> Picture:
    """Write `predicted.png` into a folder.

    Args:
        folder: Of the files of the tracking.
        comparison: The solutions.
        tracking: What the film says.
        frame: Of the pressed finger.
    """
    camera = "virtual camera’s" if tracking.simulated else "camera’s"
    return Picture(
        draw_predictions(comparison, tracking, frame).save(folder / "predicted.png"),
        "Predicted finger in the film",
        f"The {camera} frame of the pressed finger, and in it (yellow) the outline that each solver "
        "predicts, mapped through the plane that the film gave: the paper’s Fig. 5. Circles: the markers as "
        "they were tracked. Crosses: the solver’s.",
    )


def draw_predictions(comparison: Results, tracking: Tracking, frame: Frame) -> Figure:
    """Draw the outline of every solver's deformed finger into a frame, one panel each."""
    plane = tracking.final_plane or tracking.plane
    nodes, image = comparison.mesh.points, frame.image
    bodies = [plane.pixels(_pictured(each, comparison)) for each in comparison.evaluations]
    shown = [body for body, each in zip(bodies, comparison.evaluations, strict=True) if each.converged]
    (left, top), (right, bottom) = _window(np.concatenate([plane.pixels(nodes), *shown]), image)
    columns = 1 if len(bodies) == 1 else 2
    rows = -(-len(bodies) // columns)
    page = COLUMN if len(bodies) == 1 else PAGE
    width = (page - GAP * (columns + 1)) / columns
    height = width * (bottom - top) / (right - left)
    with figure(HEAD + rows * (TITLE + height + GAP), page) as drawn:
        write_heading(drawn, "Predicted finger in the film")
        for number, (body, evaluation) in enumerate(zip(bodies, comparison.evaluations, strict=True)):
            row, column = divmod(number, columns)
            place = (GAP + column * (width + GAP), HEAD + TITLE + row * (TITLE + height + GAP))
            axes = axes_at(drawn, (*place, width, height))
            axes.imshow(image if image.ndim == 2 else image[..., ::-1], cmap="gray", vmin=0, vmax=255)
            axes.set(xlim=(left, right), ylim=(bottom, top))
            axes.set_axis_off()
            edges = body[comparison.mesh.boundary_edges]
            axes.add_collection(LineCollection(list(edges), colors=BODY, lw=0.7, path_effects=RIM))
            computed = comparison.observations.points + evaluation.shown_displacement
            _markers(axes, tracking.pixels[frame.number], plane.pixels(computed))
            note = errors_note(comparison.scores[evaluation.solver])
            axes.set_title(f"{evaluation.label_at_markers}\n{note}", size=SMALL)
        label = f"markers, {comparison.observations.label}"
        handles = [
            Line2D([], [], ls="", marker="o", ms=5, mfc="none", mec=MEASURED, mew=1.1, label=label),
            Line2D([], [], ls="", marker="x", ms=4, color=INK, mew=0.9, label="solver’s markers"),
            Line2D([], [], color=BODY, lw=1.2, path_effects=RIM, label="solver’s outline"),
        ]
        legend_below_heading(drawn, handles, length=1.6)
    return drawn


def _pictured(evaluation: Evaluation, comparison: Results) -> FloatArray:
    """Places of the deformed body's nodes in the pressed picture, shape (n, 2), mm.

    Where the solver found the picture's frame, the similarity that takes its markers there takes the nodes.
    """
    moved = comparison.mesh.points + evaluation.node_displacement
    if evaluation.shown is None:
        return np.asarray(moved)
    rest = comparison.observations.points
    own, shown = rest + evaluation.marker_displacement, rest + evaluation.shown
    return nearest_similarity(own, shown).moved(moved)


def _window(pixels: FloatArray, image: Image) -> tuple[FloatArray, FloatArray]:
    """The first and the last pixel, x and y, of the part of the image around points, shape (n, 2)."""
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    margin, size = MARGIN * (high - low).max(), np.array(image.shape[1::-1])
    return np.clip(low - margin, 0, size - 1), np.clip(high + margin, 0, size - 1)


def _markers(axes: Axes, seen: FloatArray, computed: FloatArray) -> None:
    """The markers of the frame, and those of a solver, shape (m, 2), pixels."""
    for size, colour in ((2.0, "white"), (1.1, MEASURED)):
        axes.plot(*seen.T, "o", ms=5, mfc="none", mec=colour, mew=size)
    for size, colour in ((2.0, "white"), (0.9, INK)):
        axes.plot(*computed.T, "x", ms=4, color=colour, mew=size)
