"""Hooke's law of the plane states from E and ν, independent of `pinnray.solvers.elasticity`."""

from dataclasses import dataclass

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.problem import Material


@dataclass(frozen=True)
class PlaneLaw:
    """The law of plane stress; that of plane strain is the same with other constants.

    Attributes:
        modulus: E, or E / (1 - ν²) in plane strain, MPa.
        ratio: ν, or ν / (1 - ν) in plane strain.

    Source: M. H. Sadd, Elasticity, table 7.1.
    """

    modulus: float
    ratio: float

    @classmethod
    def of(cls, material: Material) -> "PlaneLaw":
        """The constants of a material's plane state."""
        young, poisson = material.young, material.poisson
        if material.plane == "stress":
            return cls(young, poisson)
        return cls(young / (1 - poisson**2), poisson / (1 - poisson))

    def stress(self, gradient: FloatArray) -> FloatArray:
        """Stress, MPa, of displacement gradients, both of shape (n, 2, 2)."""
        strain = 0.5 * (gradient + gradient.swapaxes(1, 2))
        trace = np.trace(strain, axis1=1, axis2=2)[:, None, None]
        scale = self.modulus / (1 - self.ratio**2)
        return scale * ((1 - self.ratio) * strain + self.ratio * trace * np.eye(2))

    def energy_density(self, stress: FloatArray) -> FloatArray:
        """Strain energy density, shape (n,), MPa, of stresses of shape (n, 2, 2), MPa."""
        trace = np.trace(stress, axis1=1, axis2=2)
        square = (stress**2).sum(axis=(1, 2))
        return ((1 + self.ratio) * square - self.ratio * trace**2) / (2 * self.modulus)
