"""Time of an epoch of the paper's training: ours, plain automatic differentiation, and DeepXDE.

The same two modified MLPs (4 gates of 64 neurons), the same nodes with equal weights, the same energy and soft
conditions, single precision, Adam; each with one thread and with all, of which the faster counts. Takes about
two minutes.
"""

import contextlib
import io
import os
import time
from collections.abc import Callable

import numpy as np
import torch
from rich.table import Table

from geometry.arrays import FloatArray
from geometry.cache import finger_mesh
from geometry.design import Design
from geometry.settings import MeshSettings
from solvers.pinn.collocation import base_points
from solvers.pinn.paper import PaperPinnSolver
from solvers.problem import Problem, contact_functional
from tests.solvers.autograd_reference import PlainMlp, PlainPinn

os.environ.setdefault("DDE_BACKEND", "pytorch")  # read when DeepXDE is imported

SIZES = {0.25: 10, 0.083: 3}
"""Element sizes, mm: of the shared mesh and of the paper's; and how many epochs are timed."""


def main() -> Table:
    """Time all."""
    table = Table(title="Paper's preset: seconds for an epoch")
    for column in ("nodes", "ours", "plain autograd", "DeepXDE", "plain / ours", "DeepXDE / ours"):
        table.add_column(column, justify="right")
    for size, epochs in SIZES.items():
        problem = Problem(finger_mesh(Design(), settings=MeshSettings(size=size)))
        ours, plain, deepxde = (
            min(make(problem, threads, epochs) for threads in {1, torch.get_num_threads()})
            for make in (_ours, _plain, _deepxde)
        )
        table.add_row(
            str(len(problem.mesh.points)),
            *(f"{seconds:.3f}" for seconds in (ours, plain, deepxde)),
            *(f"{seconds / ours:.1f}" for seconds in (plain, deepxde)),
        )
    return table


def _ours(problem: Problem, threads: int, epochs: int) -> float:
    solver = PaperPinnSolver()
    loss = solver.loss(problem)
    parameters = solver.network.initial(0, torch.float32)
    adam = torch.optim.Adam([parameters], lr=solver.learning_rate)

    def step() -> None:
        parameters.grad = loss(parameters).gradient
        adam.step()

    return _seconds(step, threads, epochs)


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

    base = base_points(problem.mesh, PaperPinnSolver().base_points).astype(np.float32)
    contact, functional = contact_functional(problem)
    weights = torch.tensor(functional, dtype=torch.float32)[:, None]

    def mean_over_contact(points: object, values: torch.Tensor, _: object) -> torch.Tensor:
        mean = (values[-len(contact) :] * weights).sum(dim=0)  # DeepXDE puts these points last
        return mean.expand(len(values), 2)

    conditions = [dde.icbc.PointSetBC(base, np.zeros((len(base), 1)), component=k) for k in range(2)]
    young, poisson = problem.material.young, problem.material.poisson
    λ, μ = problem.material.lame.λ, problem.material.lame.μ
