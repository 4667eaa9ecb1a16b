"""Training of every weight of a finite-basis network, on its energy alone, which is quadratic.

The output layer minimises the energy exactly for whatever neurons, so that the least energy is a function of
the neurons; quasi-Newton steps lower it.

Sources: G. Golub, V. Pereyra, Inverse Problems 19 (2003) R1-R26 (variable projection); J. Nocedal,
S. J. Wright, Numerical Optimization, 2nd ed. 2006, section 7.2 (L-BFGS).
"""

from dataclasses import dataclass

import torch
from scipy.optimize import minimize

from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.pinn.finite_basis.constrained_network import ConstrainedNetwork, NewtonIterate
from pinnray.solvers.pinn.finite_basis.newton import LoadStep
from pinnray.solvers.pinn.finite_basis.windows import ShepardWindows
from pinnray.solvers.solver import Progress

MEMORY = 20
"""Steps that L-BFGS remembers."""


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
    trained = _Training(network, start.state, windows)
    if not trained.lowest:  # at rest, where no neuron counts
        return network, start
    first = trained.places(network.energy.basis.neurons)
    highest, count = trained.lowest, 0

    def report(_: FloatArray) -> None:
        nonlocal count
        count += 1
        progress(min(count / steps, 1.0), f"step {count}, energy {trained.lowest:.4f} N mm/mm")

    minimize(
        lambda places: trained.value_and_slopes(places, highest),
        first.numpy().ravel(),
        jac=True,
        method="L-BFGS-B",
        callback=report,
        options={"maxiter": steps, "maxcor": MEMORY, "ftol": 0.0, "gtol": 0.0},
    )
    return trained.network, LoadStep(1.0, trained.state, start.iterations + trained.evaluations)


@dataclass(eq=False)
class _Training:
    """The best network so far."""

    network: ConstrainedNetwork
    state: NewtonIterate  # Its equilibrium
    windows: ShepardWindows
    evaluations: int = 0

    def __post_init__(self) -> None:
        self.lowest, _ = self.network.least(self.state)

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
        places = torch.from_numpy(flat.reshape(self.network.energy.basis.neurons.shape))
        network = self.network.with_neurons(self.neurons(places), self.state.factor)
        state = network.at_rest()
        self.evaluations += 1
        value, slopes = network.least(state)
        if value <= self.lowest:
            self.network, self.lowest, self.state = network, value, state
        slopes[:2] = (slopes[:2] - slopes[2] * self.windows.centres.T[:, None]) / self.windows.radii
        return value / scale, slopes.numpy().ravel() / scale
