"""The paper's training, 60,000 epochs of Adam over the nodes of the shared mesh, looked at on its way.

`pinn-std` with the preset `paper`, for two loads and three seeds. At each of `LOOKS` the displacement is
compared with `fem` on the same mesh and with the simulated markers, as in the paper's Table I. Writes
`docs/paper-run.csv`, `docs/paper-losses.csv`, and the pictures and table of `docs/paper-run.md`. A training
takes about 35 minutes on two quiet cores; `--seconds` ends it earlier, and the next start goes on from the
last checkpoint.
"""

import csv
import sys
import time
from collections.abc import Iterator, Sequence
from itertools import groupby
from math import inf
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.ticker import NullFormatter, PercentFormatter
from rich.table import Table

from benchmarks.tables import DOCS, fill, keep_rows, kept_rows, markdown
from compare.evaluation.evaluation import Evaluation
from compare.evaluation.metrics import marker_errors, reference_differences
from compare.evaluation.virtual_experiment import virtual_experiment
from compare.runtime.tables import terminal_table
from geometry.cache import finger_mesh
from geometry.figure import INK, MUTED, figure
from geometry.finger.design import Design
from solvers.fem.linear import FemSolver
from solvers.pinn.paper.solver import PaperPinnSolver
from solvers.problem import Load, Problem
from solvers.solver import TrainingContext

FIGURES, LOSSES = DOCS / "paper-run.csv", DOCS / "paper-losses.csv"
PAGE, MARK = DOCS / "paper-run.md", "table of the paper's run"
CHECKPOINTS = Path("out") / "paper-run"

RUNS = (("mean", 0), ("point", 0), ("mean", 1), ("mean", 2))
"""Loads and seeds, in the order in which they are trained."""

LOOKS = (250, 500, 1000, 2000, 4000, 6000, 9000, 13_000, 18_000, 24_000, 30_000, 40_000, 50_000, 60_000)
"""Epochs after which the network is compared."""

HEADER = (
    *("load, seed", "epochs", "s", "energy / fem", "L², %", "von Mises, %", "markers, mm"),
    *("MAE u", "MAE v"),
)


class Look(NamedTuple):
    """A network after some epochs and seconds of training.

    Attributes:
        energy: Elastic energy over the energy of `fem`.
        displacement: Relative L2 difference from `fem` over the body.
        von_mises: Relative L2 difference of the von Mises stress.
        markers: Mean difference from `fem` at the markers, |Δu| + |Δv|, mm.
        mae_u: Mean absolute error of u at the simulated markers, mm; `fem_mae_u` is the error of `fem`.
    """

    load: str
    seed: int
    epoch: int
    seconds: float
    energy: float
    displacement: float
    von_mises: float
    markers: float
    mae_u: float
    mae_v: float
    fem_mae_u: float
    fem_mae_v: float


class Losses(NamedTuple):
    """Both terms of the loss after an epoch, MPa and mm², as the training wrote them."""

    load: str
    seed: str
    epoch: str
    PDE: str
    BC: str


def main(seconds: float = inf) -> Table:
    """Train from where an earlier start ended, and write figures, pictures and table."""
    looks, end = {look[:3]: look for look in kept_rows(FIGURES, Look)}, time.monotonic() + seconds
    for kind, seed in RUNS:
        known = {epoch for load, of, epoch in looks if (load, of) == (kind, seed)}
        for look in train(kind, seed, known, end):
            looks[look[:3]] = look
            write(list(looks.values()))
            write_losses(kind, seed)
    last = {look[:2]: look for look in looks.values()}
    rows = [cells(look) for look in last.values()]
    return terminal_table("pinn-std --preset paper against fem on the shared mesh", HEADER, rows)


def train(kind: str, seed: int, known: set[int], end: float) -> Iterator[Look]:
    """The looks at one training that are not known yet, until the clock says `end`.

    Args:
        kind: Of the load.
        seed: Of the initial weights.
        known: Epochs of the looks that are known.
        end: Time of `time.monotonic` at which to stop.
    """
    if known.issuperset(LOOKS):
        return
    design = Design()
    problem = Problem(finger_mesh(design), load=Load(kind=kind))
    observed, _ = virtual_experiment(Problem(problem.mesh), design.marker_radius)
    fem = Evaluation.of(FemSolver(estimate=False).solve(problem), problem.mesh)
    ours = marker_errors(fem, observed)
    context = TrainingContext(CHECKPOINTS / f"{kind}-{seed}", resume=True, reference_energy=fem.energy)
    for epochs in (look for look in LOOKS if look not in known):
        if time.monotonic() > end:
            return
        solution = PaperPinnSolver(epochs=epochs, seed=seed).in_context(context).solve(problem)
        evaluation = Evaluation.of(solution, problem.mesh)
        to, own = reference_differences(evaluation, fem), marker_errors(evaluation, observed)
        trained = float(solution.history["seconds"][-1])
        errors = (to.displacement.rel_l2, to.von_mises.rel_l2, to.mae_markers)
        at_markers = (own.mae_u, own.mae_v, ours.mae_u, ours.mae_v)
        look = Look(kind, seed, epochs, round(trained), solution.energy / fem.energy, *errors, *at_markers)
        print(*cells(look), file=sys.stderr, flush=True)
        yield look


def write(looks: Sequence[Look]) -> None:
    """Write figures, picture and the page's table."""
    keep_rows(FIGURES, Look, looks)
    draw(looks)
    fill(PAGE, MARK, markdown(HEADER, map(cells, looks)))


def write_losses(kind: str, seed: int) -> None:
    """Keep one value in 100 of a training's losses, and draw those of all."""
    with (CHECKPOINTS / f"{kind}-{seed}" / "history.csv").open(encoding="utf-8") as file:
        ours = [
            Losses(kind, str(seed), row["epoch"], row["PDE [MPa]"], row["BC [mm2]"])
            for row in csv.DictReader(file)
            if int(row["epoch"]) % 100 == 0
        ]
    rows = [row for row in kept_rows(LOSSES, Losses) if row[:2] != (kind, str(seed))] + ours
    keep_rows(LOSSES, Losses, rows)
    draw_losses(rows)


def cells(look: Look) -> tuple[str, ...]:
    """The row of the table."""
    percents = (f"{100 * value:.3g}" for value in (look.displacement, look.von_mises))
    lengths = (f"{value:.2f}" for value in (look.markers, look.mae_u, look.mae_v))
    run, ratio = f"{look.load}, {look.seed}", f"{look.energy:.3g}"
    return run, f"{look.epoch}", f"{look.seconds:.0f}", ratio, *percents, *lengths


def draw_losses(rows: Sequence[Losses]) -> None:
    """Both terms of the loss over the epochs, as the paper's Fig. 7 has the first."""
    mesh = finger_mesh(Design())
    least = FemSolver(estimate=False).solve(Problem(mesh)).energy / mesh.areas.sum()
    with figure(4.4) as drawn:
        drawn.subplots_adjust(left=0.16, right=0.94, top=0.97, bottom=0.1, hspace=0.1)
        axes = drawn.subplots(2, sharex=True)
        for number, ((kind, seed), group) in enumerate(groupby(rows, key=lambda row: row[:2])):
            epochs, pde, bc = np.array([row[2:] for row in group], dtype=float).T
            for panel, values in zip(axes, (pde, bc), strict=True):
                panel.plot(epochs, values, lw=0.6, c=f"C{number}", label=f"{kind} load, seed {seed}")
        axes[0].axhline(least, color=MUTED, lw=0.8, label="mean energy density of fem")
        axes[0].set(yscale="log", ylabel="L_PDE, MPa")
        axes[1].set(yscale="log", ylabel="L_BC, mm²", xlabel="epochs", xlim=(0, LOOKS[-1]))
        axes[0].legend(loc="upper right")
    drawn.save(DOCS / "pictures" / "paper-losses.png")


def draw(looks: Sequence[Look]) -> None:
    """Energy, differences from `fem` and errors at the markers over the epochs."""
    with figure(6.2) as drawn:
        drawn.subplots_adjust(left=0.16, right=0.97, top=0.97, bottom=0.07, hspace=0.12)
        energy, differences, markers = drawn.subplots(3, sharex=True)
        for number, ((kind, seed), group) in enumerate(groupby(looks, key=lambda look: look[:2])):
            run = list(group)
            for axes, name, style, label in (
                (energy, "energy", "o-", f"{kind} load, seed {seed}"),
                (differences, "displacement", "o-", None),
                (differences, "von_mises", "s--", None),
                (markers, "mae_u", "o-", None),
                (markers, "mae_v", "s--", None),
            ):
                values = [getattr(look, name) for look in run]
                axes.plot([look.epoch for look in run], values, style, ms=2.5, c=f"C{number}", label=label)
        energy.axhline(1, color=MUTED, lw=0.8)
        energy.set(yscale="log", ylabel="energy over that of fem")
        differences.set(yscale="log", ylim=(1e-2, None), ylabel="relative L² difference from fem")
        markers.set(xscale="log", ylim=(0, None), xlabel="epochs", ylabel="MAE at the markers, mm")
        for axes in (energy, differences):
            axes.yaxis.set_minor_formatter(NullFormatter())
        differences.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
        markers.axhline(looks[-1].fem_mae_u, color=MUTED, lw=0.8, label="the same of fem")
        markers.axhline(looks[-1].fem_mae_v, color=MUTED, lw=0.8, ls="--")
        energy.legend(loc="lower left")
        for axes, first, second in ((differences, "displacement", "von Mises stress"), (markers, "u", "v")):
            lines = [Line2D([], [], color=INK, marker="o", ms=2.5, label=first)]
            lines.append(Line2D([], [], color=INK, marker="s", ms=2.5, ls="--", label=second))
            place = "center right" if axes is markers else "lower left"
            axes.legend(handles=[*lines, *axes.get_legend_handles_labels()[0]], loc=place)
    drawn.save(DOCS / "pictures" / "paper-run.png")
