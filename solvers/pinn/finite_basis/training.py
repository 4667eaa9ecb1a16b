"""Training of every weight of a finite-basis network, on its energy alone.

The output layer minimises the energy exactly for whatever neurons, so that the least energy is a function of
the neurons; quasi-Newton steps lower it. At finite strain it minimises the energy's expansion to second
order about the best displacement so far, which other neurons change little: one factorisation a step.

Sources: G. Golub, V. Pereyra, Inverse Problems 19 (2003) R1-R26 (variable projection); J. Nocedal,
S. J. Wright, Numerical Optimization, 2nd ed. 2006, section 7.2 (L-BFGS).
"""

from dataclasses import dataclass

import numpy as np
import torch
from scipy.optimize import minimize

from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.pinn.finite_basis.constrained_network import ConstrainedNetwork
from pinnray.solvers.pinn.finite_basis.newton import LoadStep, find_equilibrium
from pinnray.solvers.pinn.finite_basis.windows import ShepardWindows
from pinnray.solvers.solver import NoSolutionError, Progress

MEMORY = 20
"""Steps that L-BFGS remembers."""

RISE = 1.5
"""Energy over the lowest one at which neurons that turn a point inside out are entered in a line search."""


def with_trained_neurons(
    network: ConstrainedNetwork, start: LoadStep, windows: ShepardWindows, steps: int, progress: Progress
) -> tuple[ConstrainedNetwork, LoadStep]:
    """A network with the neurons after some steps, and its equilibrium under the whole load.

    Args:
        network: With the first neurons.
        start: Its equilibrium.
        windows: Its windows.
        steps: Of L-BFGS.
        progress: Told of every step.
    """
    trained = _Training(network, start, windows)
    if not trained.lowest:  # at rest, where no neuron counts
        return network, start
    first = trained.places(network.energy.basis.neurons)
    highest = trained.lowest

    def report(_: FloatArray) -> None:
        trained.count += 1
        text = f"step {trained.count}, energy {trained.lowest:.4f} N mm/mm"
        progress(min(trained.count / steps, 1.0), text)

    minimize(
        lambda places: trained.value_and_slopes(places, highest),
        first.numpy().ravel(),
        jac=True,
        method="L-BFGS-B",
        callback=report,
        options={"maxiter": steps, "maxcor": MEMORY, "ftol": 0.0, "gtol": 0.0},
    )
    return trained.network, trained.settled()


@dataclass(eq=False)
class _Training:
    """The best network so far."""

    network: ConstrainedNetwork
    reached: LoadStep  # Its equilibrium
    windows: ShepardWindows
    count: int = 0  # Of steps

    def __post_init__(self) -> None:
        self.lowest, _ = self.network.least(self.reached.state)
        self._gradient = self._reached_gradient()

    def _reached_gradient(self) -> torch.Tensor:
        """Displacement gradient of the best network at the quadrature points, (q, 2, 2)."""
        return self.network.energy.gradients(self.reached.state.output[None])[0]

    def settled(self) -> LoadStep:
        """The equilibrium of the best network, which the training knows to second order at finite strain.

        Raises:
            NoSolutionError: If Newton's method finds none there.
        """
        if self.network.energy.material.law == "linear" or not self.count:
            return self.reached
        state, iterations = find_equilibrium(self.network, self.reached.state.output, 1.0)
        if state is None:
            raise NoSolutionError("the trained network has no equilibrium near; take fewer steps")
        return self.reached._replace(state=state, iterations=self.reached.iterations + iterations)

    def places(self, neurons: torch.Tensor) -> torch.Tensor:
        """Weights of the position in radii from a window's centre, and the bias there, shape (3, m, c)."""
        bias = neurons[2] + torch.einsum("xmc,cx->mc", neurons[:2], self.windows.centres)
        return torch.cat([neurons[:2] * self.windows.radii, bias[None]])

    def neurons(self, places: torch.Tensor) -> torch.Tensor:
        """The inverse of `places`."""
        weights = places[:2] / self.windows.radii
        bias = places[2] - torch.einsum("xmc,cx->mc", weights, self.windows.centres)
        return torch.cat([weights, bias[None]])

    def value_and_slopes(self, flat: FloatArray, scale: float) -> tuple[float, FloatArray]:
        """The least energy over a scale, and its derivatives, for neurons by `places`."""
        now = self.network.energy.basis.neurons
        places = torch.from_numpy(flat.reshape(now.shape))
        network = self.network.with_neurons(self.neurons(places), self.reached.state.factor)
        state = network.step_from(self._gradient)
        iterations = self.reached.iterations + 1
        value, slopes = network.least(state)
        if not np.isfinite(value):  # a point is turned inside out
            return RISE * self.lowest / scale, np.zeros(flat.size)
        if value <= self.lowest:
            self.network, self.lowest = network, value
            self.reached = LoadStep(1.0, state, iterations)
            self._gradient = self._reached_gradient()
        if network.energy.kept:
            network.energy.kept.clear()
        slopes[:2] = (slopes[:2] - slopes[2] * self.windows.centres.T[:, None]) / self.windows.radii
        return value / scale, slopes.numpy().ravel() / scale
