"""A problem as tensors, and a network as a field: what the adapters of networks share."""

from collections.abc import Callable
from typing import Any

import numpy as np
import torch

from pinnray.geometry.mesh.quadrature import body_quadrature
from pinnray.solvers.elasticity import energy_density_of
from pinnray.solvers.problem import Problem, contact_functional


class NetworkProblem:
    """What an energy method needs of a problem, as tensors of double precision.

    Attributes:
        points: Where the energy is evaluated, shape (n, 2), mm.
        areas: Their weights, shape (n,), mm².
        base: Nodes of the base, shape (b, 2), mm.
        contact: Points at which the contact is prescribed, shape (c, 2), mm.
        shares: Weights of their mean displacement, shape (c, 1); None where every point is prescribed.
        stroke: Prescribed displacement, shape (2,), mm.
    """

    def __init__(self, problem: Problem, degree: int = 1) -> None:
        """Take the points of the rule of a degree in each triangle."""
        mesh, rule = problem.mesh, body_quadrature(problem.mesh, degree)
        self._law, self._lame = problem.material.law, problem.material.lame
        self.points, self.areas = torch.tensor(rule.location.points), torch.tensor(rule.weights)
        self.base = torch.tensor(mesh.points[np.unique(mesh.boundary("base"))])
        contact, shares = contact_functional(problem)
        self.shares = torch.tensor(shares)[:, None] if problem.load.kind == "mean" else None
        if self.shares is None:
            contact = mesh.points[np.unique(mesh.boundary("contact"))]
        self.contact, self.stroke = torch.tensor(contact), torch.tensor(problem.load.values)
        low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
        self._middle, self._half = torch.tensor((low + high) / 2), float((high - low).max() / 2)

    def density(self, gradient: torch.Tensor) -> torch.Tensor:
        """Energy density at displacement gradients (n, 2, 2), shape (n,), MPa."""
        return energy_density_of(self._law, gradient, self._lame, torch.log)

    def scaled(self, points: torch.Tensor) -> torch.Tensor:
        """Points as coordinates from -1 to 1 along the longer side."""
        return (points - self._middle) / self._half

    def missed(self, moved: torch.Tensor) -> torch.Tensor:
        """By how much displacements of `contact` miss the stroke, point by point or in their mean, mm."""
        return (moved if self.shares is None else (self.shares * moved).sum(dim=0)[None]) - self.stroke


class NetworkField:
    """The displacement that a network gives at points, as a `DisplacementField`."""

    def __init__(self, network: Callable[[torch.Tensor], torch.Tensor]) -> None:
        self._network = network

    def displacement(self, location: Any) -> np.ndarray:
        """Displacement, shape (n, 2), mm."""
        with torch.no_grad():
            return self._network(torch.tensor(location.points)).numpy()

    def gradient(self, location: Any) -> np.ndarray:
        """Its gradient, shape (n, 2, 2)."""
        points = torch.tensor(location.points, requires_grad=True)
        return displacement_gradients(self._network(points), points).detach().numpy()


def displacement_gradients(moved: torch.Tensor, points: torch.Tensor) -> torch.Tensor:
    """Gradients of displacements (n, 2) by their points, shape (n, 2, 2), to be differentiated again."""
    rows = [torch.autograd.grad(part.sum(), points, create_graph=True)[0] for part in moved.T]
    return torch.stack(rows, dim=1)
