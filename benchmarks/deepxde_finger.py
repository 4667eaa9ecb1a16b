"""The finger in DeepXDE, set up as well as its interface allows: two networks minimise the strain energy.

The energy is a sum of squares of four residuals at the centroids of coarse elements, weighted by the square
roots of their areas; coordinates are scaled to the finger's length and displacements to the stroke; the
clamp is the factor d / (d + 5 mm) of the distance to the base. The load is one of

- `mean`, the default load of this project, exactly: both networks are shifted such that the mean over the
  contact is the prescribed one;
- `point`: the factor r² / (r² + 25 mm²) of the distance r to the middle of the contact, and the prescribed
  displacement there.

Each is compared with finite elements under the same load.
"""

import contextlib
import io
import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from geometry.arrays import FloatArray
from geometry.mesh.point_location import LocatedPoints
from geometry.mesh.quadrature import body_quadrature
from solvers.elasticity import Lame
from solvers.pinn.finite_basis.hard_constraint import HardConstraint
from solvers.problem import Problem, contact_functional

os.environ.setdefault("DDE_BACKEND", "pytorch")  # read when DeepXDE is imported

BASE_LENGTH = 5.0
CONTACT_LENGTH = 5.0
WIDTH, LAYERS = 32, 4
LEARNING_RATE = 3e-3


@dataclass(frozen=True, eq=False)
class NetworkField:
    """A network of (x, y), mm, with outputs (u, v), mm, as a displacement field."""

    network: Callable[[torch.Tensor], torch.Tensor]

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Displacement, shape (n, 2), mm."""
        with torch.no_grad():
            return self.network(_tensor(location.points)).double().numpy()

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 2, 2)."""
        points = _tensor(location.points).requires_grad_()
        values = self.network(points)
        rows = [torch.autograd.grad(values[:, i].sum(), points, retain_graph=True)[0] for i in range(2)]
        return torch.stack(rows, dim=1).double().numpy()


def train(problem: Problem, watch: Callable[[NetworkField], bool], *, seed: int = 0) -> None:
    """Train on the problem until `watch` returns False.

    Args:
        problem: On the mesh whose centroids are the collocation points.
        watch: Takes the field after every iteration; returns whether to go on.
        seed: Seed of the initial weights.
    """
    import deepxde as dde

    class Show(dde.callbacks.Callback):
        def on_epoch_end(self) -> None:
            self.model.stop_training = not watch(field)

    with contextlib.redirect_stdout(io.StringIO()):
        dde.config.set_random_seed(seed)
        rule = body_quadrature(problem.mesh, 1)
        roots = np.sqrt(rule.weights * len(rule.weights))[:, None].astype(np.float32)
        points = rule.location.points.astype(np.float32)
        parts = energy_residuals(dde, problem.material.lame)

        def residuals(
            points: torch.Tensor, values: torch.Tensor, weights: torch.Tensor
        ) -> list[torch.Tensor]:
            return [weights * part for part in parts(points, values)]

        data = dde.data.PDE(
            dde.geometry.PointCloud(points),
            residuals,
            [],
            num_domain=0,
            anchors=points,
            auxiliary_var_function=lambda _: roots,
        )
        network = dde.nn.PFNN([2, *[[WIDTH, WIDTH]] * LAYERS, 2], "tanh", "Glorot normal")
        field = NetworkField(conditioned(network, problem))
        model = dde.Model(data, network)
        model.compile("adam", lr=LEARNING_RATE)
        model.train(iterations=10**9, display_every=10**9, callbacks=[Show()])


def conditioned(network: Any, problem: Problem) -> Callable[[torch.Tensor], torch.Tensor]:
    """Scale a DeepXDE network's input and output, in place, and make it satisfy the clamp and the load."""
    box = problem.mesh.points.min(axis=0), problem.mesh.points.max(axis=0)
    middle, half = _tensor((box[0] + box[1]) / 2), float((box[1] - box[0]).max() / 2)
    stroke = float(np.abs(problem.load.values).max())
    factor = HardConstraint.of(problem.mesh, BASE_LENGTH)
    contact, weights = map(_tensor, contact_functional(problem))
    prescribed = _tensor(np.array([value or 0.0 for value in problem.load.displacement]))
    shape = factor.at(contact)[0] * weights[:, None]
    network.apply_feature_transform(lambda points: (points - middle) / half)

    def at_point(points: torch.Tensor, output: torch.Tensor) -> torch.Tensor:
        square = ((points - contact) ** 2).sum(dim=1, keepdim=True)
        away = square / (square + CONTACT_LENGTH**2)
        free = stroke * away * output
        return factor.at(points)[0] * (free + (1 - away) * prescribed / shape)

    def in_mean(points: torch.Tensor, output: torch.Tensor) -> torch.Tensor:
        body, edge = stroke * output[: -len(contact)], stroke * output[-len(contact) :]
        shift = (prescribed - (shape * edge).sum(dim=0)) / shape.sum()
        return factor.at(points[: -len(contact)])[0] * (body + shift)

    if problem.load.kind == "point":
        network.apply_output_transform(at_point)
        return network
    network.apply_output_transform(in_mean)
    plain = network.forward
    network.forward = lambda points: plain(torch.cat([points, contact]))
    return network


def energy_residuals(dde: Any, lame: Lame) -> Callable[..., list[torch.Tensor]]:
    """The equations for DeepXDE: four residuals whose squares add up to the strain energy density, MPa."""
    λ, μ = lame.λ, lame.μ

    def parts(points: torch.Tensor, values: torch.Tensor) -> list[torch.Tensor]:
        xx, yy = (dde.grad.jacobian(values, points, i=k, j=k) for k in range(2))
        xy = (dde.grad.jacobian(values, points, i=0, j=1) + dde.grad.jacobian(values, points, i=1, j=0)) / 2
        return [(λ / 2) ** 0.5 * (xx + yy), μ**0.5 * xx, μ**0.5 * yy, (2 * μ) ** 0.5 * xy]

    return parts


def _tensor(array: FloatArray) -> torch.Tensor:
    return torch.tensor(np.asarray(array), dtype=torch.float32)
