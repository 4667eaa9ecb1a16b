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
        patch: Whether every point of the contact is prescribed, and not their mean alone.
        contact: Its points, shape (c, 2), mm.
        weights: Of their mean, shape (c, 1).
        stroke: Prescribed displacement, shape (2,), mm.
    """

    def __init__(self, problem: Problem, degree: int = 1) -> None:
        """Take the points of the rule of a degree in each triangle."""
        mesh, rule = problem.mesh, body_quadrature(problem.mesh, degree)
        self._law, self._lame = problem.material.law, problem.material.lame
        self.points, self.areas = torch.tensor(rule.location.points), torch.tensor(rule.weights)
        contact, weights = contact_functional(problem)
        self.patch = problem.load.kind == "patch"
        if self.patch:
            contact = mesh.points[np.unique(mesh.boundary("contact"))]
            weights = np.full(len(contact), 1 / len(contact))
        self.contact, self.weights = torch.tensor(contact), torch.tensor(weights)[:, None]
        self.stroke = torch.tensor(problem.load.values)
        low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
        self._middle, self._half = torch.tensor((low + high) / 2), float((high - low).max() / 2)
        base = torch.tensor(mesh.points[mesh.boundary("base").ravel()])
        self._first, last = base[base[:, 1].argmin()], base[base[:, 1].argmax()]
        along = (last - self._first) / (last - self._first).norm()
        self._normal = torch.stack([along[1], -along[0]]) / self._half

    def density(self, gradient: torch.Tensor) -> torch.Tensor:
        """Energy density at displacement gradients (n, 2, 2), shape (n,), MPa."""
        return energy_density_of(self._law, gradient, self._lame, torch.log)

    def scaled(self, points: torch.Tensor) -> torch.Tensor:
        """Points as coordinates from -1 to 1 along the longer side."""
        return (points - self._middle) / self._half

    def displacement(self, output: torch.Tensor, points: torch.Tensor) -> torch.Tensor:
        """Displacement, mm, of points of which those of the contact are last, by a network's output (n, 2).

        It is w + (t - mean of w) d / mean of d, where t is the stroke, the means are over the contact, and
        w = t d N with the output N and the distance d from the line of the base: both are met exactly.
        """
        away = ((points - self._first) @ self._normal).abs()[:, None]
        own = self.stroke.abs().max() * away * output
        means = [(self.weights * each[-len(self.contact) :]).sum(dim=0) for each in (own, away)]
        return own + (self.stroke - means[0]) * away / means[1]

    def missed(self, moved: torch.Tensor) -> torch.Tensor:
        """Mean square by which displacements of the contact's points miss the stroke, mm²."""
        return ((moved - self.stroke) ** 2).sum(dim=1).mean()


class NetworkField:
    """The displacement that a network gives at points and, last, those of the contact."""

    def __init__(self, network: Callable[[torch.Tensor], torch.Tensor], given: NetworkProblem) -> None:
        self._network, self._contact = network, given.contact

    def displacement(self, location: Any) -> np.ndarray:
        """Displacement, shape (n, 2), mm."""
        with torch.no_grad():
            return self._moved(torch.tensor(location.points)).numpy()

    def gradient(self, location: Any) -> np.ndarray:
        """Its gradient, shape (n, 2, 2)."""
        points = torch.tensor(location.points, requires_grad=True)
        return displacement_gradients(self._moved(points), points).detach().numpy()

    def _moved(self, points: torch.Tensor) -> torch.Tensor:
        return self._network(torch.cat([points, self._contact]))[: len(points)]


def displacement_gradients(moved: torch.Tensor, points: torch.Tensor) -> torch.Tensor:
    """Gradients of displacements (n, 2) by their points, shape (n, 2, 2), to be differentiated again."""
    rows = [torch.autograd.grad(part.sum(), points, create_graph=True)[0] for part in moved.T]
    return torch.stack(rows, dim=1)
