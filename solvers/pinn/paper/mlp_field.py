"""Trained modified MLPs as a displacement field."""

from dataclasses import dataclass

import numpy as np
import torch

from geometry.arrays import FloatArray
from geometry.mesh.point_location import LocatedPoints
from solvers.pinn.paper.mlp_passes import MlpPass
from solvers.pinn.paper.modified_mlp import ModifiedMlp
from solvers.pinn.threading import in_pieces


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
        result = torch.empty(len(location), 2, dtype=torch.float64)
        self._evaluate(location, result, slopes=False)
        return np.asarray(result.numpy())

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 2, 2)."""
        result = torch.empty(len(location), 2, 2, dtype=torch.float64)
        self._evaluate(location, result, slopes=True)
        return np.asarray(result.numpy())

    def _evaluate(self, location: LocatedPoints, result: torch.Tensor, *, slopes: bool) -> None:
        points = torch.from_numpy(np.array(location.points))
        weights = self.network.weights(self.network.in_logistic_form(self.parameters))

        def task(rows: slice) -> None:
            networks = MlpPass(self.network, weights, points[rows])
            result[rows] = (networks.slopes() if slopes else networks.values()).transpose(0, 1)

        in_pieces(task, len(points), self.network.width)
