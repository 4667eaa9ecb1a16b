"""DeepXDE's networks trained on the energy: its points, losses and optimisers, and an energy as the loss.

DeepXDE has no energy method of its own: a residual of its class PDE is an energy density times area, and the
loss is their sum. Its transform of the output holds the base and moves the contact in the mean.
"""

import os
import time
from dataclasses import dataclass

import torch

os.environ.setdefault("DDE_BACKEND", "pytorch")
import deepxde as dde

from benchmarks.entries.network_problem import NetworkField, NetworkProblem
from pinnray.solvers.energy_and_force import energy_and_force
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution, Status
from pinnray.solvers.solver import Progress, check_problem, silent


@dataclass(frozen=True)
class DeepXdeEntry:
    """A network of its class FNN.

    Attributes:
        width: Neurons in a layer.
        layers: Hidden layers.
        adam: Steps of Adam.
        lbfgs: Steps of L-BFGS after them.
        rate: Learning rate of Adam.
        penalty: Weight of the contact's points over Young's modulus, where each is prescribed.
        seed: Of the random numbers.
    """

    width: int = 30
    layers: int = 3
    adam: int = 200
    lbfgs: int = 200
    rate: float = 1e-3
    penalty: float = 100.0
    seed: int = 0
    name = "deepxde"
    family = "neural network"
    laws = ("linear", "neo-hookean")
    loads = ("mean", "patch")

    def settings(self) -> dict[str, object]:
        """All fields, and the version."""
        return {**vars(self), "DeepXDE": dde.__version__}

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Train on the problem."""
        check_problem(self, problem)
        started, given = time.perf_counter(), NetworkProblem(problem)
        dde.config.set_default_float("float64")
        dde.config.set_random_seed(self.seed)
        dde.optimizers.config.set_LBFGS_options(maxcor=50, maxiter=self.lbfgs, ftol=0, gtol=0)
        at_once = {"iter_per_step": self.lbfgs, "fun_per_step": int(1.25 * self.lbfgs)}
        dde.optimizers.config.LBFGS_options.update(at_once)  # its own of 1,000 would be passed before it asks
        inside, factor = len(given.points), self.penalty * problem.material.young

        def energies(x, y):
            rows = [dde.grad.jacobian(y, x, i=axis)[:inside] for axis in (0, 1)]
            energy = (given.areas * given.density(torch.stack(rows, dim=1))).sum()
            return [energy.reshape(1), *([factor * given.missed(y[inside:]).reshape(1)] * given.patch)]

        points = torch.cat([given.points, given.contact]).numpy()
        data = dde.data.PDE(dde.geometry.PointCloud(points), energies, [], anchors=points)
        data.train_x_all = data.train_x = points  # in this order
        data.train_next_batch = lambda batch_size=None: (points, None, None)
        net = dde.nn.FNN([2, *[self.width] * self.layers, 2], "tanh", "Glorot normal")
        net.apply_feature_transform(given.scaled)
        net.apply_output_transform(lambda x, y: given.displacement(y, x))
        model = dde.Model(data, net)
        model.compile("adam", lr=self.rate, loss=lambda _, value: value.sum())
        model.train(iterations=self.adam, display_every=100_000, verbose=0)
        model.compile("L-BFGS", loss=lambda _, value: value.sum())
        history, _ = model.train(display_every=100_000, verbose=0)
        field = NetworkField(net, given)
        energy, reaction = energy_and_force(problem, field)
        stats = {"seconds": time.perf_counter() - started, "parameters": net.num_trainable_parameters()}
        message = f"DeepXDE has no criterion; the loss ended at {sum(history.loss_train[-1]):.3g}"
        return Solution(self.name, problem, field, energy, reaction, Status(False, message), stats)
