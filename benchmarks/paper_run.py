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
from collections.abc import Iterator
from itertools import groupby
from math import inf
from pathlib import Path
from typing import Literal, NamedTuple

from matplotlib.lines import Line2D
from matplotlib.ticker import NullFormatter, PercentFormatter
from rich.table import Table

from compare.evaluation.evaluation import Evaluation
from compare.evaluation.metrics import marker_errors, reference_differences
from compare.evaluation.virtual_experiment import virtual_experiment
from compare.runtime.tables import write_csv
from geometry.atomic import write_text
from geometry.cache import finger_mesh
from geometry.figure import INK, MUTED, figure
from geometry.finger.design import Design
from solvers.fem.linear import FemSolver
from solvers.pinn.paper.solver import PaperPinnSolver
from solvers.problem import Load, Problem
from solvers.solver import TrainingContext

DOCS = Path(__file__).parents[1] / "docs"
FIGURES, PAGE, PICTURE = DOCS / "paper-run.csv", DOCS / "paper-run.md", DOCS / "pictures" / "paper-run.png"
LOSSES, LOSS_PICTURE = DOCS / "paper-losses.csv", DOCS / "pictures" / "paper-losses.png"
CHECKPOINTS = Path("out") / "paper-run"
BEGIN, END = "<!-- table of the paper's run -->\n", "<!-- end of the table -->\n"

Kind = Literal["mean", "point"]
RUNS: tuple[tuple[Kind, int], ...] = (("mean", 0), ("point", 0), ("mean", 1), ("mean", 2))
"""Loads and seeds, in the order in which they are trained."""

LOOKS = (250, 500, 1000, 2000, 4000, 6000, 9000, 13_000, 18_000, 24_000, 30_000, 40_000, 50_000, 60_000)
"""Epochs after which the network is compared."""


EACH = 100
"""Epochs from one kept value of the losses to the next."""


LOSS_COLUMNS = ("load", "seed", "epoch", "PDE", "BC")
RECORDED = ("epoch", "PDE [MPa]", "BC [mm2]")
"""Columns of a training's history that are kept."""


class Look(NamedTuple):
    """A network after some epochs.

    Attributes:
        load: Kind of the load.
        seed: Of the initial weights.
        epoch: Epochs so far.
        seconds: Time of the training so far.
        energy: Elastic energy over that of `fem`.
        displacement: Relative L2 difference from `fem` over the body.
        von_mises: The same for the von Mises stress.
        markers: Mean difference from `fem` at the markers, |Δu| + |Δv|, mm.
        mae_u: Mean absolute error of u at the simulated markers, mm.
        mae_v: The same for v.
        fem_mae_u: That of `fem`.
        fem_mae_v: The same for v.
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


def main(seconds: float = inf) -> Table:
    """Train from where an earlier start ended, and write figures, picture and table."""
    looks, end = {look[:3]: look for look in read()}, time.monotonic() + seconds
    for kind, seed in RUNS:
        known = {epoch for load, of, epoch in looks if (load, of) == (kind, seed)}
        for look in train(kind, seed, known, end):
            looks[look[:3]] = look
            write(list(looks.values()))
            write_losses(kind, seed)
    return table(list(looks.values()))


def train(kind: Kind, seed: int, known: set[int], end: float) -> Iterator[Look]:
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
        print(f"{kind}, seed {seed}: {', '.join(cells(look))}", file=sys.stderr, flush=True)
        yield look


def read() -> list[Look]:
    """The looks of `FIGURES`."""
    if not FIGURES.exists():
        return []
    with FIGURES.open(encoding="utf-8") as file:
        return [
            Look(row["load"], int(row["seed"]), int(row["epoch"]), *map(float, list(row.values())[3:]))
            for row in csv.DictReader(file)
        ]


def write(looks: list[Look]) -> None:
    """Write figures, picture and the page's table."""
    write_csv(FIGURES, [look._asdict() for look in looks])
    draw(looks)
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    rows = [HEADER, ("---",) + ("---:",) * (len(HEADER) - 1)]
    rows += [(f"{look.load}, {look.seed}", *cells(look)) for look in looks]
    lines = "".join(f"| {' | '.join(row)} |\n" for row in rows)
    write_text(PAGE, before + BEGIN + lines + END + rest.partition(END)[2])


def write_losses(kind: Kind, seed: int) -> None:
    """Keep the losses of a training, and draw those of all."""
    folder = CHECKPOINTS / f"{kind}-{seed}"
    with (folder / "history.csv").open(encoding="utf-8") as file:
        ours = [
            dict(zip(LOSS_COLUMNS, (kind, str(seed), *(row[name] for name in RECORDED)), strict=True))
            for row in csv.DictReader(file)
            if int(row["epoch"]) % EACH == 0
        ]
    kept = [row for row in read_losses() if (row["load"], row["seed"]) != (kind, str(seed))]
    write_csv(LOSSES, [*kept, *ours])
    draw_losses([*kept, *ours])


def read_losses() -> list[dict[str, str]]:
    """The rows of `LOSSES`."""
    if not LOSSES.exists():
        return []
    with LOSSES.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def draw_losses(rows: list[dict[str, str]]) -> None:
    """Both terms of the loss over the epochs, as the paper's Fig. 7 has the first."""
    mesh = finger_mesh(Design())
    least = FemSolver(estimate=False).solve(Problem(mesh)).energy / mesh.areas.sum()
    with figure(4.4) as drawn:
        drawn.subplots_adjust(left=0.16, right=0.94, top=0.97, bottom=0.1, hspace=0.1)
        axes = drawn.subplots(2, sharex=True)
        runs = groupby(rows, key=lambda row: (row["load"], row["seed"]))
        for number, ((kind, seed), group) in enumerate(runs):
            run = list(group)
            epochs = [int(row["epoch"]) for row in run]
            for panel, term in zip(axes, ("PDE", "BC"), strict=True):
                values = [float(row[term]) for row in run]
                panel.plot(epochs, values, lw=0.6, c=f"C{number}", label=f"{kind} load, seed {seed}")
        axes[0].axhline(least, color=MUTED, lw=0.8, label="mean energy density of fem")
        axes[0].set(yscale="log", ylabel="L_PDE, MPa")
        axes[1].set(yscale="log", ylabel="L_BC, mm²", xlabel="epochs", xlim=(0, LOOKS[-1]))
        axes[0].legend(loc="upper right")
    drawn.save(LOSS_PICTURE)


HEADER = (
    "load, seed",
    "epochs",
    "s",
    "energy / fem",
    "L², %",
    "von Mises, %",
    "markers, mm",
    "MAE u",
    "MAE v",
)


def cells(look: Look) -> tuple[str, ...]:
    """The row of the table, without load and seed."""
    percents = (f"{100 * value:.3g}" for value in (look.displacement, look.von_mises))
    lengths = (f"{value:.2f}" for value in (look.markers, look.mae_u, look.mae_v))
    return f"{look.epoch}", f"{look.seconds:.0f}", f"{look.energy:.3g}", *percents, *lengths


def table(looks: list[Look]) -> Table:
    """The last look at every training."""
    shown = Table(title="pinn-std --preset paper against fem on the shared mesh")
    for name in HEADER:
        shown.add_column(name, justify="right", no_wrap=True)
    for _, group in groupby(looks, key=lambda look: look[:2]):
        last = list(group)[-1]
        shown.add_row(f"{last.load}, {last.seed}", *cells(last))
    return shown


def draw(looks: list[Look]) -> None:
    """Energy, differences from `fem` and errors at the markers over the epochs."""
    runs = [list(group) for _, group in groupby(looks, key=lambda look: look[:2])]
    with figure(6.2) as drawn:
        drawn.subplots_adjust(left=0.16, right=0.97, top=0.97, bottom=0.07, hspace=0.12)
        energy, differences, markers = drawn.subplots(3, sharex=True)
        for number, run in enumerate(runs):
            epochs = [look.epoch for look in run]
            label = f"{run[0].load} load, seed {run[0].seed}"
            energy.plot(epochs, [look.energy for look in run], "o-", ms=2.5, c=f"C{number}", label=label)
            for axes, name, style in (
                (differences, "displacement", "o-"),
                (differences, "von_mises", "s--"),
                (markers, "mae_u", "o-"),
                (markers, "mae_v", "s--"),
            ):
                axes.plot(epochs, [getattr(look, name) for look in run], style, ms=2.5, c=f"C{number}")
        energy.axhline(1, color=MUTED, lw=0.8)
        energy.set(yscale="log", ylabel="energy over that of fem")
        differences.set(yscale="log", ylim=(1e-2, None), ylabel="relative L² difference from fem")
        markers.set(xscale="log", ylim=(0, None), xlabel="epochs", ylabel="MAE at the markers, mm")
        for axes in (energy, differences):
            axes.yaxis.set_minor_formatter(NullFormatter())
        differences.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
        for name, style in (("fem_mae_u", "-"), ("fem_mae_v", "--")):
            markers.axhline(getattr(looks[-1], name), color=MUTED, lw=0.8, ls=style)
        energy.legend(loc="lower left")
        for axes, first, second in ((differences, "displacement", "von Mises stress"), (markers, "u", "v")):
            lines = [Line2D([], [], color=INK, marker="o", ms=2.5, label=first)]
            lines.append(Line2D([], [], color=INK, marker="s", ms=2.5, ls="--", label=second))
            if axes is markers:
                lines.append(Line2D([], [], color=MUTED, lw=0.8, label="the same of fem"))
            axes.legend(handles=lines, loc="center right" if axes is markers else "lower left")
    drawn.save(PICTURE)
