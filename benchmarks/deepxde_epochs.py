"""Time of an epoch of the paper's training: ours, plain automatic differentiation, and DeepXDE.

The same two modified MLPs (4 gates of 64 neurons), the same nodes with equal weights, the same energy, soft
conditions with the point load, for which DeepXDE has a class, single precision, Adam; the faster of one
thread and all. Takes about two minutes.

The last column says how near an epoch is to what its matrix products alone would take at the speed of one of
their shape, measured in the same run. A gated network's value and two derivatives at a node take three
products with each of its matrices, and the gradient twice as many again.
"""

import contextlib
import io
import time
from collections.abc import Callable
from contextlib import AbstractContextManager

import numpy as np
import torch
from rich.table import Table

from benchmarks.deepxde_finger import energy_residuals
from geometry.cache import finger_mesh
from geometry.finger.design import Design
from geometry.mesh.settings import MeshSettings
from solvers.pinn.paper.collocation import base_points
from solvers.pinn.paper.solver import PaperPinnSolver
from solvers.pinn.threading import CHUNK, pool
from solvers.problem import Load, Problem, contact_functional
from tests.solvers.autograd_reference import PlainMlp, PlainPinn

SIZES = {0.25: 10, 0.083: 3}
"""Element sizes, mm, of the shared mesh and of the paper's, with the number of timed epochs."""
COLUMNS = ("nodes", "ours", "plain autograd", "DeepXDE", "plain / ours", "DeepXDE / ours", "products / ours")


def main() -> Table:
    """Time all."""
    table = Table(title="Paper's preset: seconds for an epoch")
    for column in COLUMNS:
        table.add_column(column, justify="right")
    for size, epochs in SIZES.items():
        problem = Problem(finger_mesh(Design(), settings=MeshSettings(size=size)), load=Load(kind="point"))
        ours, plain, deepxde = (
            min(make(problem, threads, epochs) for threads in {1, torch.get_num_threads()})
            for make in (_ours, _plain, _deepxde)
        )
        table.add_row(
            str(len(problem.mesh.points)),
            *(f"{seconds:.3f}" for seconds in (ours, plain, deepxde)),
            *(f"{seconds / ours:.1f}" for seconds in (plain, deepxde)),
            f"{100 * least_seconds(problem) / ours:.0f} %",
        )
    return table


def least_seconds(problem: Problem) -> float:
    """Time of an epoch's matrix products alone, with the faster of one thread and all."""
    network = PaperPinnSolver().network
    weights, passes = network.networks * network.gates * network.width**2, 3 * (1 + 2)
    left, right = torch.rand(network.width, network.width), torch.rand(network.width, CHUNK // network.width)
    products = 2000
    seconds = min(
        _seconds(lambda: [torch.mm(left, right) for _ in range(products)], threads, 5)
        for threads in {1, torch.get_num_threads()}
    )
    speed = products * left.numel() * right.shape[1] / seconds
    return float(passes * weights * len(problem.mesh.points) / speed)


def _ours(problem: Problem, threads: int, epochs: int) -> float:
    solver = PaperPinnSolver()
    loss = solver.loss(problem)
    parameters = solver.network.initial(0, torch.float32)
    adam = torch.optim.Adam([parameters], lr=solver.learning_rate)

    def step() -> None:
        parameters.grad = loss(parameters).gradient
        adam.step()

    return _seconds(step, threads, epochs, during=pool)


def _plain(problem: Problem, threads: int, epochs: int) -> float:
    return _seconds(PlainPinn(problem, PaperPinnSolver(), torch.float32).step, threads, epochs)


def _deepxde(problem: Problem, threads: int, epochs: int) -> float:
    import deepxde as dde

    class Networks(dde.nn.NN):
        def __init__(self) -> None:
            super().__init__()
            self.parts = torch.nn.ModuleList(PlainMlp(64, 4, False) for _ in range(2))

        def forward(self, points: torch.Tensor) -> torch.Tensor:
            return torch.stack([part(points) for part in self.parts], dim=1)

    solver = PaperPinnSolver()
    nodes, base = (
        points.astype(np.float32)
        for points in (problem.mesh.points, base_points(problem.mesh, solver.base_points))
    )
    contact, _ = contact_functional(problem)
    conditions = [
        dde.icbc.PointSetBC(points, np.full((len(points), 1), value), component=axis)
        for axis, moved in enumerate(problem.load.displacement)
        for points, value in ((base, 0.0), (contact, moved))
    ]
    with contextlib.redirect_stdout(io.StringIO()):
        data = dde.data.PDE(
            dde.geometry.PointCloud(nodes),
            energy_residuals(dde, problem.material.lame),
            conditions,
            num_domain=0,
            anchors=nodes,
        )
        model = dde.Model(data, Networks())
        parts = [1.0] * 4 + [solver.bc_weight] * len(conditions)
        model.compile("adam", lr=solver.learning_rate, loss_weights=parts)
        batch = data.train_next_batch()
    return _seconds(lambda: model.train_step(*batch), threads, epochs)


def _seconds(
    step: Callable[[], object],
    threads: int,
    epochs: int,
    during: Callable[[], AbstractContextManager[object]] = contextlib.nullcontext,
) -> float:
    """Mean time of a step with a number of threads, without the first step."""
    before = torch.get_num_threads()
    torch.set_num_threads(threads)
    try:
        with during():
            step()
            started = time.perf_counter()
            for _ in range(epochs):
                step()
            return (time.perf_counter() - started) / epochs
    finally:
        torch.set_num_threads(before)
