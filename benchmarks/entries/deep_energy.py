"""A plain deep-energy network by Adam and L-BFGS, as papers write it; and one with Fourier features.

Sources: E. Samaniego et al., An energy approach to the solution of partial differential equations in
computational mechanics via machine learning, CMAME 362 (2020) 112790; M. Tancik et al., Fourier features let
networks learn high frequency functions in low dimensional domains, NeurIPS 2020.
"""

import time
from dataclasses import dataclass
from itertools import pairwise

import torch

from benchmarks.entries.network_problem import NetworkField, NetworkProblem, displacement_gradients
from pinnray.solvers.energy_and_force import energy_and_force
from pinnray.solvers.problem import Problem
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
        given = NetworkProblem(problem, self.quadrature)
        network = Network(self, given)
        energies = self._train(network, given, 100 * problem.material.young, progress)
        field = NetworkField(network, given)
        energy, reaction = energy_and_force(problem, field)
        change = abs(energies[-1] / energies[-len(energies) // 10] - 1)
        message = f"the energy changed by {change:.1e} in the last tenth of {len(energies)} steps"
        stats = {"seconds": time.perf_counter() - started, "steps": len(energies)}
        return Solution(
            self.name, problem, field, energy, reaction, Status(bool(change < STEADY), message), stats
        )

    def _train(
        self, network: "Network", given: NetworkProblem, penalty: float, progress: Progress
    ) -> list[float]:
        """Minimise the energy; returns it at every step."""
        points, energies = torch.cat([given.points, given.contact]).requires_grad_(), list[float]()
        inside = len(given.points)

        def loss() -> torch.Tensor:
            optimiser.zero_grad()
            moved = network(points)
            gradient = displacement_gradients(moved[:inside], points)[:inside]
            value = (given.areas * given.density(gradient)).sum()
            energies.append(value.item())
            if given.patch:  # the mean is met exactly, the rest by a penalty
                value = value + penalty * given.missed(moved[inside:])
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
    """Layers of tanh neurons, with Fourier features before them if there are any."""

    def __init__(self, solver: DeepEnergySolver, given: NetworkProblem) -> None:
        super().__init__()
        self._given = given
        self._frequencies = torch.pi * solver.scale * torch.randn(2, solver.features, dtype=torch.float64)
        widths = [2 * solver.features or 2, *[solver.width] * solver.layers, 2]
        layers: list[torch.nn.Module] = []
        for inputs, outputs in pairwise(widths):
            layers += [torch.nn.Linear(inputs, outputs, dtype=torch.float64), torch.nn.Tanh()]
            torch.nn.init.xavier_normal_(layers[-2].weight)
        for part in layers[-2].parameters() if solver.features else ():
            torch.nn.init.zeros_(part)  # else the first displacements turn the material inside out
        self._layers = torch.nn.Sequential(*layers[:-1])

    def forward(self, points: torch.Tensor) -> torch.Tensor:
        """Displacement, mm."""
        places = self._given.scaled(points)
        if self._frequencies.shape[1]:
            phases = places @ self._frequencies
            places = torch.cat([phases.sin(), phases.cos()], dim=1)
        return self._given.displacement(self._layers(places), points)
