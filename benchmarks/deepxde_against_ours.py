"""Error against wall time: DeepXDE, `pinn-std` and `pinn-local` on the default finger, in one run.

DeepXDE trains under the default load and under a point load, each compared with finite elements under the
same load; ours are compared with the better of the two. Our curves are separate runs of growing size. Takes
twice `seconds` and about two minutes.
"""

import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import torch
from rich.table import Table

from benchmarks import deepxde_finger
from benchmarks.judge import Judge, Judged, Watch
from geometry.cache import finger_mesh
from geometry.finger.design import Design
from geometry.mesh.settings import MeshSettings
from solvers.pinn.finite_basis.local import PinnLocalSolver
from solvers.pinn.finite_basis.standard import PinnStdSolver
from solvers.problem import Load, Problem
from solvers.solver import Solver

SECONDS = 200.0
TRIAL_SECONDS = 3.0
POINT_SPACING = 1.0
"""Size of the elements that DeepXDE's points are the centroids of, mm."""

SCALES = (6.0, 4.0, 2.5, 1.5, 1.0)
"""Spacings of our networks, as multiples of the default ones."""

OURS: Mapping[str, Sequence[Solver]] = {
    kind.name: [
        kind(
            wall_spacing=scale * kind.wall_spacing,
            corner_spacing=scale * kind.corner_spacing,
            growth=scale * kind.growth,
        )
        for scale in SCALES
    ]
    for kind in (PinnStdSolver, PinnLocalSolver)
}
PICTURE = Path("out/benchmarks/deepxde.png")


def main(seconds: float = SECONDS) -> Table:
    """Train all and compare."""
    curves = {f"DeepXDE, {kind} load": deepxde_curve(Load(kind=kind), seconds) for kind in ("mean", "point")}
    best = min(curves.values(), key=lambda curve: curve[-1].displacement)[-1]
    judge = Judge.of()
    for name, solvers in OURS.items():
        curves[name] = []
        for solver in solvers:
            solution = solver.solve(judge.problem)
            curves[name].append(judge(float(solution.stats["seconds"]), solution.field))
    _draw(curves)
    table = Table(title=f"Against DeepXDE: error and time; picture in {PICTURE}")
    for column in (
        "network",
        "time, s",
        "L2, %",
        "von Mises, %",
        "energy, %",
        "s to DeepXDE's best",
        "ratio",
    ):
        table.add_column(column, justify="left" if column == "network" else "right")
    for name, curve in curves.items():
        last = curve[-1]
        reached = min(
            (look.seconds for look in curve if look.displacement <= best.displacement), default=None
        )
        table.add_row(
            name,
            f"{last.seconds:.0f}" if last.seconds > 10 else f"{last.seconds:.1f}",
            f"{last.displacement:.2g}",
            f"{last.von_mises:.2g}",
            f"{last.energy:+.2g}",
            "not reached" if reached is None else f"{reached:.2g}",
            "" if reached is None else f"{best.seconds / reached:.0f}",
        )
    return table


def deepxde_curve(load: Load, seconds: float) -> list[Judged]:
    """Train DeepXDE's networks with the faster number of threads, one or all."""
    judge = Judge.of(load)
    problem = Problem(finger_mesh(Design(), settings=MeshSettings(size=POINT_SPACING)), load=load)
    threads = torch.get_num_threads()
    try:
        torch.set_num_threads(max({1, threads}, key=lambda count: _steps(problem, count)))
        watch = Watch(judge, seconds)
        deepxde_finger.train(problem, watch)
    finally:
        torch.set_num_threads(threads)
    return watch.curve


def _steps(problem: Problem, threads: int) -> int:
    """Number of iterations in a few seconds, without the first, which includes the set-up."""
    torch.set_num_threads(threads)
    starts: list[float] = []

    def count(_: object) -> bool:
        starts.append(time.perf_counter())
        return starts[-1] - starts[0] < TRIAL_SECONDS

    deepxde_finger.train(problem, count)
    return len(starts)


def _draw(curves: Mapping[str, Sequence[Judged]]) -> None:
    figure, axes = plt.subplots(figsize=(7, 4.5), layout="constrained")
    for name, curve in curves.items():
        axes.loglog([look.seconds for look in curve], [look.displacement for look in curve], "o-", label=name)
    axes.set(xlabel="wall time, s", ylabel="relative L2 error of the displacement, %")
    axes.grid(which="both", alpha=0.3)
    axes.legend()
    PICTURE.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(PICTURE, dpi=150)
    plt.close(figure)
