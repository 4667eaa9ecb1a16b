"""An equilibrium on the way of a cylinder, with its derivatives."""

from dataclasses import dataclass, replace

import numpy as np

from pinnray.runtime.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class WayPoint:
    """An equilibrium on the way, with derivatives by p unknowns; the front has m points."""

    share: float  # Of the travel
    state: FloatArray
    forces: FloatArray  # On the front, shape (m, 2), N/mm; zero where it does not touch
    places: FloatArray  # Of the front on the cylinder, shape (m,), mm
    slopes: FloatArray  # Of the state, shape (p, *shape)
    force_slopes: FloatArray  # Shape (p, m, 2)
    place_slopes: FloatArray  # Shape (p, m)
    final: bool = False  # Whether it is only moved to first order, not solved again

    def moved(self, step: FloatArray) -> "WayPoint":
        """The stage after a step of the unknowns, shape (p,), to first order."""
        return replace(
            self,
            state=self.state + np.tensordot(step, self.slopes, axes=1),
            forces=self.forces + np.tensordot(step, self.force_slopes, axes=1),
            places=self.places + step @ self.place_slopes,
        )
