"""DeepXDE's networks trained on the energy: its points, losses and optimisers, and an energy as the loss.

DeepXDE has no energy method of its own: a residual of its class PDE is an energy density times area, and the
loss is their sum. Base and contact are met by penalties, as its examples of elasticity do.
"""

import os
import time
from dataclasses import dataclass

import numpy as np
import torch

os.environ.setdefault("DDE_BACKEND", "pytorch")
import deepxde as dde

from pinnray.geometry.mesh.quadrature import body_quadrature
from pinnray.solvers.elasticity import energy_density_of
from pinnray.solvers.energy_and_force import energy_and_force
from pinnray.solvers.problem import Problem, contact_functional
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
        penalty: Weight of base and contact over Young's modulus.
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
        started, mesh, law = time.perf_counter(), problem.mesh, problem.material.law
        dde.config.set_default_float("float64")
        dde.config.set_random_seed(self.seed)
        dde.optimizers.config.set_LBFGS_options(maxcor=50, maxiter=self.lbfgs, ftol=0, gtol=0)
        rule = body_quadrature(mesh, 1)
        base = mesh.points[np.unique(mesh.boundary("base"))]
        contact, shares = contact_functional(problem)
        if problem.load.kind == "patch":
            contact = mesh.points[np.unique(mesh.boundary("contact"))]
        inside, clamped = len(rule.weights), len(rule.weights) + len(base)
        areas, stroke = torch.tensor(rule.weights), torch.tensor(problem.load.values)
        factor = self.penalty * problem.material.young

        def energies(x, y):
            rows = [dde.grad.jacobian(y, x, i=axis)[:inside] for axis in (0, 1)]
            gradient = torch.stack(rows, dim=1)
            energy = areas * energy_density_of(law, gradient, problem.material.lame, torch.log)
            missed = y[clamped:] - stroke
            if problem.load.kind == "mean":
                missed = (torch.tensor(shares)[:, None] * missed).sum(dim=0)[None]
            held = [factor * (each**2).mean() for each in (y[inside:clamped], missed)]
            return [each.reshape(1) for each in (energy.sum(), *held)]

        points = np.concatenate([rule.location.points, base, contact])
        data = dde.data.PDE(dde.geometry.PointCloud(points), energies, [], anchors=points)
        data.train_x_all = data.train_x = points  # in this order
        data.train_next_batch = lambda batch_size=None: (points, None, None)
        net = dde.nn.FNN([2, *[self.width] * self.layers, 2], "tanh", "Glorot normal")
        low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
        half, size = torch.tensor((low + high) / 2), float((high - low).max() / 2)
        net.apply_feature_transform(lambda x: (x - half) / size)
        net.apply_output_transform(lambda _, y: y * stroke.abs().max())
        model = dde.Model(data, net)
        model.compile("adam", lr=self.rate, loss=lambda _, value: value.sum())
        model.train(iterations=self.adam, display_every=100_000, verbose=0)
        model.compile("L-BFGS", loss=lambda _, value: value.sum())
        history, _ = model.train(display_every=100_000, verbose=0)
        field = Field(net)
        energy, reaction = energy_and_force(problem, field)
        stats = {"seconds": time.perf_counter() - started, "parameters": net.num_trainable_parameters()}
        message = f"DeepXDE has no criterion; the loss ended at {sum(history.loss_train[-1]):.3g}"
        return Solution(self.name, problem, field, energy, reaction, Status(False, message), stats)


class Field:
    """The displacement of a network."""

    def __init__(self, net: torch.nn.Module) -> None:
        self._net = net

    def displacement(self, location) -> np.ndarray:
        """Displacement, shape (n, 2), mm."""
        with torch.no_grad():
            return self._net(torch.tensor(location.points)).numpy()

    def gradient(self, location) -> np.ndarray:
        """Its gradient, shape (n, 2, 2)."""
        points = torch.tensor(location.points, requires_grad=True)
        moved = self._net(points)
        rows = [torch.autograd.grad(part.sum(), points, retain_graph=True)[0] for part in moved.T]
        return torch.stack(rows, dim=1).numpy()
