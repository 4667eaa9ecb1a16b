"""Displacement field of two trained networks: energy, reaction and convergence status."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch

from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.energy_and_force import energy_and_force
from pinnray.solvers.pinn.paper.modified_mlp import ModifiedMlp
from pinnray.solvers.pinn.paper.training import Training
from pinnray.solvers.pinn.threading import CHUNK, imap_in_threads, slices
from pinnray.solvers.problem import Problem, contact_functional
from pinnray.solvers.solution import DisplacementField, Status


@dataclass(frozen=True, eq=False)
class MlpField:
    """Two networks, one for each displacement component."""

    network: ModifiedMlp  # Their shape
    parameters: torch.Tensor  # Shape (2, parameters); in double precision

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Displacement, shape (n, 2), mm."""
        return self._evaluate(location, self.network.values)

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 2, 2)."""
        return self._evaluate(location, self.network.gradients)

    def _evaluate(
        self, location: LocatedPoints, quantity: Callable[[torch.Tensor, torch.Tensor], torch.Tensor]
    ) -> FloatArray:
        points = torch.from_numpy(np.array(location.points))

        def evaluate(rows: slice) -> torch.Tensor:
            return quantity(self.parameters, points[rows]).transpose(0, 1)

        rows = slices(len(points), max(CHUNK // self.network.width, 8))
        return np.asarray(torch.cat(list(imap_in_threads(evaluate, rows))).numpy())


ENERGY_CHANGE = 0.01
"""Largest relative change of the energy over the last tenth of the epochs of a converged training."""

HIDDEN = 2.0
"""Largest ratio of the energy by quadrature in the elements to that at the collocation points.

The energy at the nodes differed from the other by a fifth at most until, after 38,000 epochs of the paper's
recipe, the networks tore the body off its base between the first two rows of nodes: then by a factor of
thousands.
"""

VIOLATION = 0.01
"""Largest error of the displacement of base and contact, as a share of the stroke."""


def assess_training(
    problem: Problem, field: DisplacementField, training: Training
) -> tuple[float, FloatArray, Status]:
    """Energy and reaction as by `energy_and_force`; status by energy, its change, and boundary conditions."""
    energy, reaction = energy_and_force(problem, field)
    change = _late_change(training.history[:, training.columns.index("energy")])
    base, contact = _violations(problem, field)
    seen = float(training.history[-1, training.columns.index("energy")])
    hidden = energy > HIDDEN * seen
    converged = change <= ENERGY_CHANGE and max(base, contact) <= VIOLATION and not hidden
    message = (
        f"{training.epoch} epochs; over their last tenth the energy changed by {change:.2%} (criterion "
        f"{ENERGY_CHANGE:.0%}), the base moves by {base:.2%} and the contact misses its displacement by "
        f"{contact:.2%} of the stroke (criterion {VIOLATION:.0%}); "
    )
    if hidden:
        message += (
            f"but the energy is {seen:.4g} N mm/mm at the collocation points and {energy:.4g} in the "
            "elements: the displacement jumps between the points, where the loss does not see it; take the "
            "preset fast or trained, whose energy is an integral"
        )
        return energy, reaction, Status(False, message)
    message += (
        "so the training has settled, which does not say how far it is from the least energy"
        if converged
        else "so the training has not settled: take more epochs"
    )
    return energy, reaction, Status(converged, message)


def _late_change(energy: FloatArray) -> float:
    """Relative change of the mean energy from the last but one to the last twentieth of the epochs."""
    count = max(len(energy) // 20, 1)
    if len(energy) < 2 * count:
        return float("inf")
    before, after = energy[-2 * count :].reshape(2, count).mean(axis=1)
    return float(abs(after - before) / abs(after))


def _violations(problem: Problem, field: DisplacementField) -> tuple[float, float]:
    """Root mean square displacement of the base and error of the contact's, as shares of the stroke."""
    mesh, load = problem.mesh, problem.load
    nodes = np.unique(mesh.boundary("base"))
    base = field.displacement(mesh.locate(mesh.points[nodes]))
    points, weights = contact_functional(problem)
    contact = (weights @ field.displacement(mesh.locate(points)))[load.prescribed] - load.values
    stroke = np.abs(load.values).max() or 1.0
    return float(np.sqrt((base**2).sum(axis=1).mean()) / stroke), float(np.abs(contact).max() / stroke)
