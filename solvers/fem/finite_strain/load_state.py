"""Displacements and forces at one stage of the load."""

from dataclasses import dataclass

from geometry.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class LoadState:
    """A state of the finger, in equilibrium or a guess.

    Attributes:
        fraction: Fraction of the load.
        nodal: Displacements, shape (N, 2), mm.
        forces: Multipliers of the constraints, shape (k,), N/mm.
        contact: Forces of the cylinder on the nodes of the front, shape (m,), N/mm; empty without one.
    """

    fraction: float
    nodal: FloatArray
    forces: FloatArray
    contact: FloatArray
