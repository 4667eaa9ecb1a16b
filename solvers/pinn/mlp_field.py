"""Trained modified MLPs as a displacement field."""

from dataclasses import dataclass

import numpy as np
import torch

from geometry.arrays import FloatArray
from geometry.locate import Location
from solvers.pinn.modified_mlp import ModifiedMlp
from solvers.pinn.pieces import in_pieces


@dataclass(frozen=True, eq=False)
class MlpField:
    """Two networks, one for each displacement component.

    Attributes:
        network: Their shape.
        parameters: Shape (2, parameters), double precision.
    """

    network: ModifiedMlp
    parameters: torch.Tensor

    def displacement(self, location: Location) -> FloatArray:
        """Displacement, shape (n, 2), mm."""
        return self._output(location, derivatives=False)[:, :, 0]

    def gradient(self, location: Location) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 2, 2)."""
        return self._output(location, derivatives=True)[:, :, 1:]

    def _output(self, location: Location, *, derivatives: bool) -> FloatArray:
        points = torch.from_numpy(np.array(location.points))
        result = points.new_empty(len(points), 2, 3 if derivatives else 1)

        def task(rows: slice) -> None:
            layers = self.network.forward(self.parameters, points[rows], derivatives=derivatives)
            result[rows] = layers.output.permute(2, 0, 1)

        in_pieces(task, len(points), self.network.width)
        return np.asarray(result.numpy())
