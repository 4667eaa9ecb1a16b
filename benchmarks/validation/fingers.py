"""Printed fingers: forward prediction of the pressed points, and prediction of each from the others."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely

import pinnray as pr
from benchmarks.tables import markdown
from benchmarks.validation.markers import length
from benchmarks.validation.printed_finger import FINGERS, FRICTION, RADIUS, PrintedFinger
from pinnray.geometry.observations import Observations
from pinnray.geometry.picture_frame import nearest_similarity
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.figure import BODY, INK, MEASURED, MUTED, PAGE, Figure, body_figure
from pinnray.solvers.problem import Load
from pinnray.solvers.solution import Solution
from pinnray.vision.clicked_points import clicked_points, read_clicks

SIZE = 1.0
"""Of the elements, mm."""
SOLVERS = ("gp", "pinn-id", "fem-id")


@dataclass(frozen=True)
class Experiment:
    """A finger's measurements and what the solvers make of them."""

    finger: PrintedFinger

    @cached_property
    def seen(self) -> Observations:
        """Displacements of the clicked points."""
        rest, pressed = (read_clicks(path) for path in self.finger.clicks)
        source = f"points clicked in two photographs of printed finger {self.finger.name}"
        drawn = pr.load_drawing(self.finger.drawing)
        return clicked_points(
            rest, pressed, drawn.markers, marker_radius=drawn.marker_radius, scale="lengths", source=source
        ).observations

    def predicted(self, friction: float) -> Solution:
        """Forward, from the published place and travel of the cylinder; nothing is fitted."""
        load = Load(
            kind="cylinder", radius=RADIUS, displacement=(0.0, -self.finger.travel), friction=friction
        )
        return self._solved("fem-nonlinear", load)

    def left_out(self, solver: str) -> Solution:
        """The solution that has predicted every point from the others; `fem-id` is told of the cylinder."""
        travel = (0.0, -self.finger.travel)
        cylinder = Load(kind="cylinder", radius=RADIUS, displacement=travel)
        return self._solved(solver, cylinder if solver == "fem-id" else Load(displacement=travel), seen=True)

    def _solved(self, solver: str, load: Load, seen: bool = False) -> Solution:
        drawn = pr.load_drawing(self.finger.drawing)
        return pr.solve(drawn, solver, size=SIZE, load=load, measurements=self.seen if seen else None)

    def misses(self, solution: Solution) -> tuple[float, float]:
        """Rms distances from the pressed points, mm: in the picture as it is, and in a free frame."""
        places = self.places(solution)
        pressed = self.seen.points + self.seen.displacements
        free = nearest_similarity(pressed, places, rigid=True).moved(pressed)
        return length(pressed - places), length(free - places)

    def places(self, solution: Solution) -> FloatArray:
        """Where a solution has the points, shape (m, 2), mm."""
        return self.seen.points + solution.displacement(self.seen.points)


def of_fingers() -> tuple[dict[str, str], dict[str, Figure]]:
    """Words of the page, and a picture for each finger."""
    forward, held_out, forces, pictures = [], [], [], {}
    for finger in FINGERS:
        experiment = Experiment(finger)
        moved = length(experiment.seen.displacements)
        noise = float(experiment.seen.standard_deviations[0, 0]) * np.sqrt(2)
        smooth, rough = (experiment.predicted(friction) for friction in (0.0, FRICTION))
        misses = (*experiment.misses(smooth), *experiment.misses(rough))
        forward.append((finger.name, *(f"{value:.2f}" for value in (moved, noise, finger.authors, *misses))))
        solutions = {solver: experiment.left_out(solver) for solver in SOLVERS}
        away = {
            name: length(each.left_out - experiment.seen.displacements)
            for name, each in solutions.items()
            if each.left_out is not None
        }
        held_out.append((finger.name, *(f"{away[name]:.2f}" for name in SOLVERS)))
        found = solutions["fem-id"]
        assert found.identified is not None
        ended = "converged" if found.status.converged else "not converged"
        force, *ends = (f"{value:.2f}" for value in found.identified.force)
        forces.append((finger.name, "`fem-id`", force, ", ".join(ends), ended))
        forces.append(
            (finger.name, "`fem-nonlinear`, friction 0.9", f"{-rough.reaction[1]:.2f}", "", "forward")
        )
        pictures[finger.name] = picture(experiment, rough, solutions["fem-id"])
    header = ("finger", "moved", "noise", "authors", "μ = 0, as it is", "μ = 0, frame free")
    words = {
        "forward": markdown((*header, "μ = 0.9, as it is", "μ = 0.9, frame free"), forward),
        "held_out": markdown(("finger", *(f"`{name}`" for name in SOLVERS)), held_out),
        "forces": markdown(("finger", "from", "N/mm", "95 % interval", "end"), forces, left=2),
    }
    return words, pictures


def picture(experiment: Experiment, forward: Solution, fitted: Solution) -> Figure:
    """The finger pressed: prediction and points, these in the frame that brings them nearest."""
    seen, finger = experiment.seen, experiment.finger
    mesh = forward.problem.mesh
    places = experiment.places(forward)
    pressed = seen.points + seen.displacements
    motion = nearest_similarity(pressed, places, rigid=True)
    assert fitted.left_out is not None
    moved = mesh.points + forward.displacement(mesh.points)
    body = shapely.union_all(shapely.polygons(moved[mesh.triangles]))
    centre = np.array([finger.height, RADIUS - finger.travel])
    visible = np.array([(-4.0, -46.0), (76.0, 12.0)])
    title = f"Printed finger {finger.name}: predicted with friction {FRICTION:g}, and measured"
    with body_figure(visible, title, foot=0.62, page=PAGE) as (drawn, axes):
        for ring in (finger.body.exterior, *finger.body.interiors):
            axes.plot(*np.array(ring.coords).T, color=MUTED, lw=0.6, ls=(0, (3, 2)), zorder=1)
        for part in shapely.get_parts(body):
            axes.fill(*np.array(part.exterior.coords).T, facecolor=BODY, edgecolor=INK, lw=0.8, zorder=2)
            for ring in part.interiors:
                axes.fill(*np.array(ring.coords).T, facecolor="white", edgecolor=INK, lw=0.8, zorder=2)
        angles = np.linspace(0, 2 * np.pi, 200)
        circle = centre + RADIUS * np.column_stack([np.cos(angles), np.sin(angles)])
        axes.plot(*circle.T, color=MUTED, lw=0.8, label="cylinder", zorder=3)
        axes.plot(
            *places.T, "o", mfc="none", mec=INK, ms=5, mew=0.8, label="predicted, nothing fitted", zorder=5
        )
        at = motion.moved(pressed)
        axes.plot(*at.T, "o", color=MEASURED, ms=3.6, mew=0, label="measured, turn and shift free", zorder=4)
        others = motion.moved(seen.points + fitted.left_out)
        axes.plot(*others.T, "x", color=INK, ms=4, mew=0.8, label="fem-id, from the other points", zorder=6)
        drawn.legend(*axes.get_legend_handles_labels(), loc="lower center", ncols=2, columnspacing=1.8)
    return drawn
