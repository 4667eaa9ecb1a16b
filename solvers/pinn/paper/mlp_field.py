"""Displacement field of two modified MLPs."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch

from geometry.arrays import FloatArray
from geometry.mesh.point_location import LocatedPoints
from solvers.pinn.paper.mlp_passes import MlpPass
from solvers.pinn.paper.modified_mlp import ModifiedMlp
from solvers.pinn.threading import CHUNK, map_in_threads, slices


@dataclass(frozen=True, eq=False)
class MlpField:
    """Two networks, one for each displacement component.

    Attributes:
        network: Their shape.
        parameters: Shape (2, parameters); in double precision.
    """

    network: ModifiedMlp
    parameters: torch.Tensor

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Displacement, shape (n, 2), mm."""
        return self._evaluate(location, MlpPass.values)

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 2, 2)."""
        return self._evaluate(location, MlpPass.input_gradients)

    def _evaluate(self, location: LocatedPoints, quantity: Callable[[MlpPass], torch.Tensor]) -> FloatArray:
        points = torch.from_numpy(np.array(location.points))
        weights = self.network.weights(self.network.in_logistic_form(self.parameters))

        def evaluate(rows: slice) -> torch.Tensor:
            return quantity(MlpPass(self.network, weights, points[rows])).transpose(0, 1)

        rows = slices(len(points), max(CHUNK // self.network.width, 8))
        return np.asarray(torch.cat(map_in_threads(evaluate, rows)).numpy())
