"""Frames of the observations' pictures as normal unknowns, for solvers that are linear in the displacements.

With standardised values z of the frames, the displacements y(z) of the finger are those that its pictures
show, turned, shifted and scaled back. About z₀

    y(z₀) - S z₀ = u - S z + e          S = ∂y/∂z, z normal a priori

so that the unknown frames are like further errors of the observations, common to all markers. For a solver
that minimises energy plus misfit they are a compliance S Sᵀ / scale in series with the markers' springs.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from pinnray.geometry.observations import Observations
from pinnray.geometry.picture_frame import FIXED, PARTS, Homography, Pictures
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.assimilation.estimation import LEVEL, Parameter, values_of
from pinnray.solvers.assimilation.marker_forces import MarkerForces
from pinnray.solvers.assimilation.misfit import MarkerSettings, leave_one_out_displacements
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution

ROUNDS = 4
"""Linearisations about the frames that the last one found: from 5 degrees the last changes them by 1e-4."""


def picture_parameters(observations: Observations) -> list[Parameter]:
    """The unknown values of the pictures' homographies, with their priors; none where both are fixed."""
    return [
        Parameter(f"{picture}_{part}", unit, 0.0, deviation)
        for picture, known in (("pressed", observations.pressed), ("drawn", observations.drawn))
        for (part, unit), deviation in zip(PARTS.items(), known.deviations.tolist(), strict=True)
        if deviation
    ]


def pictures_of(centre: FloatArray, values: Mapping[str, float]) -> Pictures:
    """The pictures with values of `picture_parameters` by name, else zero, about a centre, (2,), mm."""
    pressed, drawn = (
        Homography(centre, np.array([values.get(f"{picture}_{part}", 0.0) for part in PARTS]))
        for picture in ("pressed", "drawn")
    )
    return Pictures(pressed, drawn)


class FramedFit(NamedTuple):
    """Frames that a minimiser of energy plus misfit finds."""

    z: FloatArray  # Standardised values, shape (p,)
    covariance: FloatArray  # Shape (p, p)
    residual_without: FloatArray  # Shown minus predicted of each marker without it, shape (m, 2), mm


class FramedData(NamedTuple):
    """Observations whose errors include those of the frames: observed = u + frames z + e."""

    observed: FloatArray  # Shape (m, 2), mm
    frames: FloatArray  # Shape (p, m, 2), mm; p = 0 where the frames are fixed


@dataclass(frozen=True, eq=False)
class FreePictures:
    """The p unknown values of the pictures' frames, and m markers that the pictures show."""

    points: FloatArray  # Shape (m, 2), mm
    shown: FloatArray  # Displacements in the pictures, shape (m, 2), mm
    parameters: Sequence[Parameter]
    centre: FloatArray  # Of turn and scale, shape (2,), mm

    @classmethod
    def of(cls, observations: Observations) -> "FreePictures":
        """Those of the markers that were seen."""
        seen, points = observations.visible, observations.points
        parameters = picture_parameters(observations)
        return cls(points[seen], observations.displacements[seen], parameters, points.mean(axis=0))

    def at(self, z: FloatArray) -> Pictures:
        """The frames of standardised values, shape (p,)."""
        values, _ = values_of(self.parameters, z)
        names = [each.name for each in self.parameters]
        return pictures_of(self.centre, dict(zip(names, values.tolist(), strict=True)))

    def about(self, z: FloatArray) -> FramedData:
        """The observations, linear in the frames about standardised values, shape (p,)."""
        own = self.at(z).own(self.points, self.shown)
        slopes = np.zeros((len(z), *own.shape))
        for number, step in enumerate(1e-4 * np.eye(len(z))):
            ahead, behind = (self.at(z + sign * step).own(self.points, self.shown) for sign in (1, -1))
            slopes[number] = (ahead - behind) / 2e-4
        return FramedData(own - np.tensordot(z, slopes, axes=1), -slopes)

    def found(self, solve: "Callable[[FramedData], FloatArray]") -> FloatArray:
        """Standardised values, shape (p,), of which `solve` finds the mean for linearised observations."""
        z = np.zeros(len(self.parameters))
        for _ in range(ROUNDS if len(z) else 0):
            z = solve(self.about(z))
        return z

    def by_forces(self, forces: MarkerForces, settings: MarkerSettings) -> FramedFit:
        """The frames at the least energy plus misfit.

        Args:
            forces: At the markers, of the displacements that the pictures show as they are.
            settings: Of the markers' weights.
        """
        undisturbed = forces.prior_residual - self.shown

        def joint(framed: FramedData) -> tuple[MarkerForces, FloatArray, float]:
            """With the frames' compliance, their rows (p, 2 m), and the factor of the weights."""
            rows = framed.frames.reshape(len(framed.frames), forces.prior_residual.size)
            compliance = forces.compliance + rows.T @ rows / settings.scale
            own = replace(forces, compliance=compliance, prior_residual=undisturbed + framed.observed)
            return own, rows, settings.factor(own)

        def found(framed: FramedData) -> FloatArray:
            own, rows, factor = joint(framed)
            return rows @ own.fit(factor).forces.ravel() / settings.scale

        z = self.found(found)
        own, rows, factor = joint(self.about(z))
        springs = own.compliance + np.diag(1 / (factor * own.weights.ravel()))
        known = rows @ np.linalg.solve(springs, rows.T) / settings.scale
        pictures = self.at(z)
        seen = pictures.pressed.undone(self.points + self.shown)
        residual = np.einsum("mij,mj->mi", pictures.jacobians(seen), own.fit(factor).residual_without)
        return FramedFit(z, np.eye(len(z)) - known, residual)

    def straightened(self, observations: Observations, z: FloatArray) -> Observations:
        """The observations as pictures in fixed frames would show them."""
        displacements = observations.displacements.copy()
        displacements[observations.visible] = self.at(z).own(self.points, self.shown)
        return replace(observations, displacements=displacements, pressed=FIXED, drawn=FIXED)

    def framed(self, solution: Solution, problem: Problem, found: FramedFit) -> Solution:
        """The solution with straightened observations as that of the problem, which has those as they are."""
        return replace(
            solution,
            problem=replace(solution.problem, observations=problem.observations),
            stats={**solution.stats, **self.numbers(found.z, found.covariance)},
            left_out=leave_one_out_displacements(problem, found.residual_without),
            pictures=self.at(found.z),
        )

    def numbers(self, z: FloatArray, covariance: FloatArray) -> dict[str, float]:
        """What was found, for tables: each value with its standard deviation and 95 % interval."""
        values, slopes = values_of(self.parameters, z)
        deviations = np.abs(slopes) * np.sqrt(np.diagonal(covariance))
        half = float(ndtri((1 + LEVEL) / 2)) * deviations
        numbers: dict[str, float] = {}
        for parameter, value, deviation, width in zip(self.parameters, values, deviations, half, strict=True):
            numbers |= {parameter.name: float(value), f"{parameter.name}_deviation": float(deviation)}
            numbers |= {f"{parameter.name}_low": float(value - width)}
            numbers |= {f"{parameter.name}_high": float(value + width)}
        return numbers
