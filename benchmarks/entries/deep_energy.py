"""A plain deep-energy network by Adam and L-BFGS, as papers write it; and one with Fourier features.

Sources: E. Samaniego et al., An energy approach to the solution of partial differential equations in
computational mechanics via machine learning, CMAME 362 (2020) 112790; M. Tancik et al., Fourier features let
networks learn high frequency functions in low dimensional domains, NeurIPS 2020.
"""

import time
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import torch

from pinnray.geometry.mesh.quadrature import body_quadrature
from pinnray.solvers.elasticity import energy_density_of
from pinnray.solvers.energy_and_force import energy_and_force
from pinnray.solvers.problem import Problem, contact_functional
from pinnray.solvers.solution import Solution, Status
from pinnray.solvers.solver import Progress, check_problem, silent

STEADY = 1e-3
"""Relative change of the energy over the last tenth of the training at which it counts as converged."""


@dataclass(frozen=True)
class DeepEnergySolver:
    """A network of tanh layers; base and mean displacement of the contact are met exactly.

    Attributes:
        width: Neurons in a layer.
        layers: Hidden layers.
        adam: Steps of Adam.
        lbfgs: Steps of L-BFGS after them.
        rate: Learning rate of Adam.
        features: Random Fourier features, sines and cosines of as many directions; 0 for none.
        scale: Standard deviation of their frequencies over the body's length.
        quadrature: Degree of the rule in each triangle, 1 for one point.
        seed: Of the random numbers.
    """

    width: int = 50
    layers: int = 4
    adam: int = 200
    lbfgs: int = 300
    rate: float = 5e-3
    features: int = 0
    scale: float = 1.0
    quadrature: int = 1
    seed: int = 0
    laws = ("linear", "neo-hookean")
    loads = ("mean", "patch")
    family = "neural network"

    @property
    def name(self) -> str:
        """With its features."""
        return "deep-energy-fourier" if self.features else "deep-energy"

    def settings(self) -> dict[str, object]:
        """All fields, and torch's version."""
        return {**vars(self), "torch": torch.__version__}

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Train on the problem."""
        check_problem(self, problem)
        started = time.perf_counter()
        torch.manual_seed(self.seed)
        network = Network(self, problem)
        energies = self._train(network, problem, progress)
        energy, reaction = energy_and_force(problem, network)
        change = abs(energies[-1] / energies[-len(energies) // 10] - 1)
        message = f"the energy changed by {change:.1e} in the last tenth of {len(energies)} steps"
        stats = {"seconds": time.perf_counter() - started, "steps": len(energies)}
        return Solution(
            self.name, problem, network, energy, reaction, Status(bool(change < STEADY), message), stats
        )

    def _train(self, network: "Network", problem: Problem, progress: Progress) -> list[float]:
        """Minimise the energy; returns it at every step."""
        rule, lame, law = (
            body_quadrature(problem.mesh, self.quadrature),
            problem.material.lame,
            problem.material.law,
        )
        points, weights = torch.tensor(rule.location.points), torch.tensor(rule.weights)
        contact = problem.mesh.points[np.unique(problem.mesh.boundary("contact"))]
        held = torch.tensor(contact) if problem.load.kind == "patch" else None
        energies: list[float] = []

        def loss() -> torch.Tensor:
            optimiser.zero_grad()
            gradient = network.gradients(points.requires_grad_(), create=True)
            value = (weights * energy_density_of(law, gradient, lame, torch.log)).sum()
            energies.append(value.item())
            if held is not None:  # the mean is met exactly, the rest by a penalty
                missed = network(held) - torch.tensor(problem.load.values)
                value = value + 100 * problem.material.young * (missed**2).sum(dim=1).mean()
            value.backward()
            return value

        optimiser: torch.optim.Optimizer = torch.optim.Adam(network.parameters(), lr=self.rate)
        for step in range(self.adam):
            optimiser.step(loss)
            progress(step / (self.adam + self.lbfgs), "")
        optimiser = torch.optim.LBFGS(
            network.parameters(), max_iter=self.lbfgs, history_size=50, line_search_fn="strong_wolfe",
            tolerance_grad=0, tolerance_change=0,
        )  # fmt: skip
        optimiser.step(loss)
        return energies


class Network(torch.nn.Module):
    """The displacement: w + (t - mean of w) d / mean of d, where w = d N and d is zero at the base."""

    def __init__(self, solver: DeepEnergySolver, problem: Problem) -> None:
        super().__init__()
        mesh = problem.mesh
        low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
        self._middle, self._length = torch.tensor((low + high) / 2), float((high - low).max() / 2)
        base = mesh.points[mesh.boundary("base").ravel()]
        first, last = base[base[:, 1].argmin()], base[base[:, 1].argmax()]
        normal = np.array([last[1] - first[1], first[0] - last[0]]) / np.linalg.norm(last - first)
        self._origin, self._normal = torch.tensor(first), torch.tensor(normal)
        points, weights = contact_functional(problem)
        self._pressed, self._weights = torch.tensor(points), torch.tensor(weights)[:, None]
        self._stroke = torch.tensor(problem.load.values)
        self._frequencies = 2 * torch.pi * solver.scale * torch.randn(2, solver.features, dtype=torch.float64)
        widths = [2 * solver.features or 2, *[solver.width] * solver.layers, 2]
        layers: list[torch.nn.Module] = []
        for inputs, outputs in pairwise(widths):
            layers += [torch.nn.Linear(inputs, outputs, dtype=torch.float64), torch.nn.Tanh()]
            torch.nn.init.xavier_normal_(layers[-2].weight)
        self._layers = torch.nn.Sequential(*layers[:-1])

    def forward(self, points: torch.Tensor) -> torch.Tensor:
        """Displacement, mm."""
        both = torch.cat([points, self._pressed])
        places = (both - self._middle) / self._length
        if self._frequencies.shape[1]:
            phases = places @ self._frequencies / 2
            places = torch.cat([phases.sin(), phases.cos()], dim=1)
        away = ((both - self._origin) @ self._normal / self._length).abs()[:, None]
        own = self._stroke.abs().max() * away * self._layers(places)
        count = len(points)
        means = [(self._weights * each[count:]).sum(dim=0) for each in (own, away)]
        return own[:count] + (self._stroke - means[0]) * away[:count] / means[1]

    def gradients(self, points: torch.Tensor, *, create: bool) -> torch.Tensor:
        """Displacement gradient at points that require gradients, shape (n, 2, 2)."""
        moved = self(points)
        rows = [torch.autograd.grad(part.sum(), points, create_graph=True)[0] for part in moved.T]
        stacked = torch.stack(rows, dim=1)
        return stacked if create else stacked.detach()

    def displacement(self, location) -> np.ndarray:
        """Displacement of the field, shape (n, 2), mm."""
        with torch.no_grad():
            return self(torch.tensor(location.points)).numpy()

    def gradient(self, location) -> np.ndarray:
        """Its gradient, shape (n, 2, 2)."""
        return self.gradients(torch.tensor(location.points, requires_grad=True), create=False).numpy()
