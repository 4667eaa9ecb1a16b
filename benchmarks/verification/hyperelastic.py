"""Hyperelastic laws in tensor form, independent of `pinnray.solvers.elasticity`.

Tensors are the last two axes, 2 by 2 (in-plane) or 3 by 3, in plane strain.
"""

from dataclasses import dataclass

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.elasticity import check_known
from pinnray.solvers.problem import Material


def trace(tensor: FloatArray) -> FloatArray:
    """The trace, kept as a tensor of one by one, so that it multiplies tensors."""
    return np.trace(tensor, axis1=-2, axis2=-1)[..., None, None]


def transposed(tensor: FloatArray) -> FloatArray:
    """The transpose."""
    return np.swapaxes(tensor, -1, -2)


@dataclass(frozen=True)
class Hyperelastic:
    """An isotropic law: μ the shear modulus, λ = K - 2/3 μ with the bulk modulus K, MPa.

    Source: J. Bonet, R. D. Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, 2nd ed., 2008,
    sections 6.4.3 (neo-Hookean) and 6.4.1 (St Venant-Kirchhoff).
    """

    law: str
    λ: float
    μ: float

    @classmethod
    def of(cls, material: Material) -> "Hyperelastic":
        """The law of a material; a `UserError` if there is no independent form of it here."""
        check_known("law", material.law, ("neo-hookean", "st-venant-kirchhoff"))
        shear = material.young / (2 * (1 + material.poisson))
        bulk = material.young / (3 * (1 - 2 * material.poisson))
        return cls(material.law, bulk - 2 / 3 * shear, shear)

    def energy_density(self, deformation: FloatArray) -> FloatArray:
        """Energy per reference volume, MPa, of deformation gradients F."""
        strain = self._strain(deformation)
        if self.law == "neo-hookean":
            logarithm = np.log(np.linalg.det(deformation))
            return self.μ * (trace(strain)[..., 0, 0] - logarithm) + 0.5 * self.λ * logarithm**2
        return 0.5 * (self._second_stress(strain) * strain).sum(axis=(-2, -1))

    def nominal_stress(self, deformation: FloatArray) -> FloatArray:
        """First Piola-Kirchhoff stress P, MPa: force per reference area."""
        if self.law == "neo-hookean":
            inverse = transposed(np.linalg.inv(deformation))
            logarithm = np.log(np.linalg.det(deformation))[..., None, None]
            return self.μ * (deformation - inverse) + self.λ * logarithm * inverse
        return deformation @ self._second_stress(self._strain(deformation))

    def change_of_stress(self, deformation: FloatArray, change: FloatArray) -> FloatArray:
        """The derivative of P along a change of F, by a complex step: exact to rounding."""
        return self.nominal_stress(deformation + 1e-30j * change).imag / 1e-30

    def cauchy_stress(self, deformation: FloatArray) -> FloatArray:
        """Force per deformed area, MPa."""
        volume = np.linalg.det(deformation)[..., None, None]
        return self.nominal_stress(deformation) @ transposed(deformation) / volume

    def _strain(self, deformation: FloatArray) -> FloatArray:
        return 0.5 * (transposed(deformation) @ deformation - np.eye(deformation.shape[-1]))

    def _second_stress(self, strain: FloatArray) -> FloatArray:
        return self.λ * trace(strain) * np.eye(strain.shape[-1]) + 2 * self.μ * strain
