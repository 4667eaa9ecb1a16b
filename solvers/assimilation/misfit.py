"""The misfit of a displacement to the markers: one definition for every solver that assimilates them.

Solvers minimise, per depth, elastic energy plus misfit:

    J(u) = E(u) + 1/2 (B u - d)^T W (B u - d)

with the displacements B u of the markers, d observed there, and a diagonal of weights W. B takes the mean
over a marker's disc, which a camera measures. With a radius of zero it takes the centre's displacement, as in
the paper; that has no limit under refinement: a point force displaces its point of a body without bound.

Sources: X. Wang et al., PINN-Ray, arXiv:2407.08222, section "Loss function", whose loss times the body's area
this is; A. M. Stuart, Inverse problems: a Bayesian perspective, Acta Numerica 19 (2010) 451-559, section 2,
for the posterior's mode.
"""

from dataclasses import dataclass
from typing import ClassVar, Literal, get_args

import numpy as np
from scipy.special import roots_legendre

from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.observations import Observations
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.assimilation.marker_forces import MarkerForces, root_mean_square
from pinnray.solvers.problem import Problem
from pinnray.solvers.solver import FieldSettings

Weighting = Literal["paper", "precision"]
Choice = Literal["given", "left-out"]

MIN_STANDARD_DEVIATION = 0.005
"""Minimum standard deviation of an observation, mm: a well-calibrated camera's; simulated ones have none."""


@dataclass(frozen=True, eq=False)
class Misfit:
    """1/2 (B u - d)^T W (B u - d) at the m markers that were seen, per depth."""

    points: FloatArray  # Positions of the markers at rest, shape (m, 2), mm
    observed: FloatArray  # Displacements d, shape (m, 2), mm
    weights: FloatArray  # The diagonal of W, shape (m, 2), MPa: N/mm of force per depth for 1 mm of misfit
    radius: float = 0.0  # Of the discs over which the displacement is averaged, mm; zero: the centres alone

    def sampling(self) -> tuple[FloatArray, FloatArray]:
        """Points (q, 2), mm, and the weights (m, q) by which a field's values there give B u."""
        return disc_quadrature(self.points, self.radius)

    def value(self, displacement: FloatArray) -> float:
        """The misfit of displacements at the markers, shape (m, 2), mm: N mm / mm."""
        return 0.5 * float((self.weights * (displacement - self.observed) ** 2).sum())


FACTORS: FloatArray = 10.0 ** np.arange(-9, 3.25, 0.25)
"""Factors of the weights on the L-curve, among which one can be chosen."""


@dataclass(frozen=True, kw_only=True)
class MarkerWeights(FieldSettings):
    """Settings of a solver that minimises the misfit to the markers together with the energy.

    Attributes:
        weights: "paper": W = 2 A λ_ASM / m, from the loss λ_ASM 1/m Σ |u - d|² beside the mean energy density
            and the body's area A. "precision": W = scale / σ², with standard deviations σ of at least
            `MIN_STANDARD_DEVIATION`, so that the minimiser of J is the mode of the posterior for the prior
            exp(-E / scale) and independent normal errors of the observations.
        asm_weight: λ_ASM, MPa/mm², for "paper".
        scale: Model error for "precision", as an energy per depth, N mm / mm: a typical deviation from the
            model's solution has half of it in every degree of freedom.
        marker_radius: Radius of the discs over which the displacement is averaged, mm; 0: the centres; None:
            the observations' own; less where a marker is nearer to the boundary of the body.
    """

    weights: Weighting = "paper"
    asm_weight: float = 1000.0
    scale: float = 1.0
    marker_radius: float | None = None
    assimilates: ClassVar[bool] = True

    def check_weights(self) -> None:
        """Raise a `UserError` if a setting is none of its names, or below zero."""
        for setting, kind in (("weights", Weighting), ("choose", Choice)):
            names, value = get_args(kind), getattr(self, setting, None)
            if value is not None and value not in names:
                raise UserError(f"{self.name}: {setting} must be {' or '.join(names)}, got {value!r}")
        self.check_not_negative("asm_weight", "scale", "marker_radius")

    def misfit(self, problem: Problem) -> Misfit | None:
        """The misfit to the markers that were seen; None without observations, or with weights of zero."""
        if (observations := problem.observations) is None or not self.asm_weight * self.scale:
            return None
        seen = observations.visible
        if self.weights == "paper":
            area = float(problem.mesh.areas.sum())
            diagonal = np.full((int(seen.sum()), 2), 2 * area * self.asm_weight / seen.sum())
        else:
            diagonal = self.scale / standard_deviations(observations) ** 2
        points = observations.points[seen]
        radius = observations.marker_radius if self.marker_radius is None else self.marker_radius
        radius = radius_within(problem.mesh, points, radius)
        return Misfit(points, observations.displacements[seen], diagonal, radius)


@dataclass(frozen=True, kw_only=True)
class MarkerSettings(MarkerWeights):
    """Settings of a solver that can choose a factor of the weights.

    Attributes:
        choose: Factor of the weights: "given" (one), or of `FACTORS` the one with the least error at markers
            left out one at a time ("left-out").
    """

    choose: Choice = "given"

    def misfit(self, problem: Problem) -> Misfit | None:
        """See `MarkerWeights`; a `UserError` refuses to choose a factor at finite strain."""
        found = super().misfit(problem)
        if found is not None and problem.material.law != "linear" and self.choose != "given":
            raise UserError(f"{self.name}: choose={self.choose} is for the linear law; take given")
        return found

    def curve(self, forces: MarkerForces) -> dict[str, FloatArray]:
        """The L-curve: energy and misfits over the factors of the weights."""
        fits = [forces.fit(factor) for factor in FACTORS]
        return {
            "weight_factor": FACTORS,
            "curve_energy": np.array([fit.energy for fit in fits]),
            "curve_in_sample_mm": np.array([root_mean_square(fit.residual) for fit in fits]),
            "curve_left_out_mm": np.array([root_mean_square(fit.residual_without) for fit in fits]),
        }

    def factor(self, forces: MarkerForces) -> float:
        """The factor chosen."""
        if self.choose == "given":
            return 1.0
        return float(FACTORS[self.curve(forces)["curve_left_out_mm"].argmin()])


def disc_quadrature(centres: FloatArray, radius: float) -> tuple[FloatArray, FloatArray]:
    """Points (q, 2), mm, and weights (m, q) that give a field's means over the discs at m centres."""
    one_each = np.eye(len(centres))
    if not radius:
        return centres, one_each
    count = 12  # equidistant angles; four Gauss points in the squared radius
    roots, shares = roots_legendre(4)
    angles = 2 * np.pi * (np.arange(count) + 0.5) / count
    distance = radius * np.sqrt(0.5 * (1 + roots))
    disc = distance[:, None, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    points = centres[:, None] + disc.reshape(-1, 2)
    return points.reshape(-1, 2), np.kron(one_each, np.repeat(shares / (2 * count), count))


def standard_deviations(observations: Observations) -> FloatArray:
    """Standard deviations at the markers seen, at least `MIN_STANDARD_DEVIATION`, shape (m, 2), mm."""
    return np.maximum(observations.standard_deviations[observations.visible], MIN_STANDARD_DEVIATION)


def leave_one_out_displacements(problem: Problem, residuals: FloatArray) -> FloatArray:
    """Displacement of each marker as predicted without it, (m, 2), mm; NaN where it was not seen.

    `residuals` are observed minus predicted, shape (number of markers seen, 2), mm.
    """
    observations = problem.observations
    assert observations is not None
    predicted = np.full(observations.displacements.shape, np.nan)
    predicted[observations.visible] = observations.displacements[observations.visible] - residuals
    return predicted


def radius_within(mesh: TriangleMesh, points: FloatArray, radius: float) -> float:
    """The radius, mm, or the least distance of points (m, 2), mm, from the boundary if that is less."""
    return min(radius, float(boundary_distances(mesh, points).min()))


def boundary_distances(mesh: TriangleMesh, points: FloatArray) -> FloatArray:
    """Distances of points (m, 2) from the boundary, shape (m,), mm."""
    start, end = mesh.points[mesh.boundary_edges].transpose(1, 0, 2)
    along, offset = end - start, points[:, None] - start
    share = ((offset * along).sum(axis=2) / (along**2).sum(axis=1)).clip(0, 1)
    return np.asarray(np.linalg.norm(offset - share[..., None] * along, axis=2).min(axis=1))
