"""The emulator of fields: modes of whole load paths, a Gaussian process for the coefficient of each.

A path is the displacement at all strokes, each divided by its stroke: nearly constant, so that small strokes
are as accurate as large ones. Between two strokes is a cubic spline, which is linear in the path.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.stages import Stages
from pinnray.solvers.elasticity import LawName
from pinnray.solvers.problem import Problem
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solution import stroke_axes
from pinnray.solvers.solver import with_law
from pinnray.studies.emulator.gaussian_process import calibrated
from pinnray.studies.emulator.inputs import Inputs
from pinnray.studies.fields.gaussian_processes import Block
from pinnray.studies.fields.prediction import PredictedField
from pinnray.studies.fields.reader import FIGURES, FieldReader, stress_at
from pinnray.studies.fields.reduction import Modes
from pinnray.studies.fields.snapshots import Snapshots
from pinnray.studies.sweep.study import Study, Value

LEAST, LEAST_OF_PATHS = 1e-6, 1e-5
"""Shares of the squared displacement gradients, and of those of paths about their mean, below which modes are
left out: smaller ones follow the elements that touch the cylinder by turns, and no process learns them."""

MOTION = 1e-10
"""Share of the squared motion of meshes below which modes are left out: these are to be exact."""

RIDGE = 1e-2
"""Penalty on the coefficients of the strength, of which few samples may have fewer than they are."""

POWERS = np.array([1, 1, 2, 0, 0])
"""Powers of the stroke by which the numbers of a path are divided."""


@dataclass(frozen=True, eq=False)
class FieldEmulator:
    """Predicts whole fields of a study's fingers; made by `fitted_fields`.

    Attributes:
        inputs: Reads the parameters of a finger.
        mesh: At rest in the middle of the ranges.
        space: Modes of displacements, r of them, without a mean.
        field: Their coefficients over the stroke along a path, vectors of k r.
        strength: Coefficients of `powers`: logarithm of the force over the stroke, half way. Forces and
            energies are predicted over it, for they span an order of magnitude where walls vary.
        numbers: Numbers of a path over powers of the stroke and over the strength, in units of `units`,
            vectors of 5 k.
        motion: Nodes of the mesh; None where no mesh moves.
        units: Shape (5,).
        known: Inputs of the samples with fields, shape (n, d).
        lost: Inputs of samples without an equilibrium under the full load, shape (l, d).
        errors: Of the samples' displacements at the full stroke, each predicted from all others, over the
            displacements, shape (n,).
        scales: Root mean squares over the samples of the displacement, then of `FIGURES`, shape (k, 1 + f).
        reasons: Why these have none.
        calibration: Half widths of their 95 % intervals over these and the indicator, shape (k, 1 + f).
    """

    inputs: Inputs
    mesh: TriangleMesh
    space: Modes
    field: Block
    strength: FloatArray
    numbers: Block
    motion: Block | None
    units: FloatArray
    known: FloatArray
    lost: FloatArray
    scales: FloatArray
    calibration: FloatArray
    errors: FloatArray
    reasons: Sequence[str] = ()

    @property
    def study(self) -> Study:
        """The study."""
        return self.inputs.study

    @property
    def stroke(self) -> float:
        """The full stroke, mm."""
        return float(self.study.fixed.get("stroke", 10.0))

    @property
    def shares(self) -> FloatArray:
        """Strokes at which fields are known over the full one, shape (k,)."""
        return np.arange(1, len(self.scales) + 1) / len(self.scales)

    def fault(self, finger: Mapping[str, Value], stroke: float) -> str | None:
        """The reason why a field cannot be predicted, or None."""
        if fault := self.inputs.fault(finger):
            return fault
        if not 0 < stroke <= self.stroke * (1 + 1e-12):
            return f"stroke = {stroke:g} is outside the sweep: above 0 to {self.stroke:g} mm"
        at = places(self.inputs, [finger])[0]
        away = ((self.lost - at) ** 2).sum(axis=1)
        if len(away) and away.min() < ((self.known - at) ** 2).sum(axis=1).min():
            return f"the nearest sample of the sweep has no field: {self.reasons[int(away.argmin())]}"
        return None

    def predict(self, finger: Mapping[str, Value], stroke: float) -> PredictedField:
        """The field of a finger at a stroke, mm; see `fault`, which is not asked again."""
        at, share = places(self.inputs, [finger])[0], stroke / self.stroke
        weights = self.spline(share)
        path = self.field.vector(at).reshape(len(weights), -1)
        factors = (share * (weights @ path)).astype(np.float32)
        nodal = (factors @ self.vectors).reshape(-1, 2).astype(np.float64)
        numbers = self.numbers.vector(at).reshape(len(weights), -1) * self.units
        force_u, force_v, energy, abscissa, width = (weights @ numbers) * share**POWERS
        problem = self.problem(finger, stroke, at)
        young = problem.material.young / self.young
        strength = young * float(np.exp(powers(at) @ self.strength))
        reaction = strength * np.array([force_u, force_v])
        if self.motion is None:
            gradients = (factors @ self.gradients).reshape(2, 2, -1).transpose(2, 0, 1)
        else:
            gradients = self.reader.gradients(problem.mesh.points, nodal[None])[0]
        stress = stress_at(gradients, self.law, problem.material.lame)
        read = self.reader.figures(problem.mesh.points, nodal, stress, float(problem.load.position or 0))
        values = (float(stroke_axes(problem.load)[0] @ reaction) * problem.mesh.depth, *read, max(width, 0.0))
        indicator = self.indicator(self.field.deviations(at), weights)
        scales, calibration = (_between(each, self.shares, share) for each in (self.scales, self.calibration))
        halves = indicator * scales * calibration
        halves[1] *= strength * problem.mesh.depth
        halves[5] *= young
        intervals = zip(FIGURES, values, halves[1:], strict=True)
        return PredictedField(
            problem=problem,
            nodal=nodal,
            von_mises=stress,
            reaction=reaction,
            energy=strength * energy,
            contact=(abscissa, max(width, 0.0)),
            figures=dict(zip(FIGURES, values, strict=True)),
            intervals={name: (value - half, value + half) for name, value, half in intervals},
            error=float(halves[0] / np.sqrt(np.mean(nodal**2))),
        )

    def problem(self, finger: Mapping[str, Value], stroke: float, at: FloatArray) -> Problem:
        """The problem that a prediction solves."""
        from pinnray.geometry.finger.design import Design

        shape = Design(**self.inputs.parameters(finger).model_dump())
        material, load = self.inputs.physics({**finger, "stroke": stroke})
        load = load.model_copy(update={"position": shape.contact_abscissa})
        mesh = self.mesh
        if self.motion is not None or shape.depth != mesh.depth:
            points = mesh.points if self.motion is None else self.motion.vector(at).reshape(-1, 2)
            mesh = replace(mesh, points=points, depth=shape.depth)
        return Problem(mesh, material.model_copy(update={"law": self.law}), load, finger=shape)

    def indicator(self, deviations: FloatArray, weights: FloatArray) -> float:
        """Expected root mean square of the displacement's error over the stroke, from modes' deviations."""
        lengths = ((self.error_modes[: len(deviations)] @ weights) ** 2).sum(axis=1)
        return float(np.sqrt(lengths @ deviations**2))

    @cached_property
    def spline(self) -> CubicSpline:
        """Weights of the strokes as functions of the share of the full one."""
        return CubicSpline(self.shares, np.eye(len(self.shares)))

    @cached_property
    def vectors(self) -> FloatArray:
        """Vectors of `space` in single precision, of which seven digits are enough, shape (r, 2 N)."""
        return self.space.vectors.astype(np.float32)

    @cached_property
    def gradients(self) -> FloatArray:
        """Gradients of the vectors at the nodes of the mesh, where it does not move: shape (r, 4 n).

        Component by component, which halves the time of the stress.
        """
        nodal = self.space.vectors.reshape(len(self.vectors), -1, 2)
        found = self.reader.gradients(self.mesh.points, nodal).transpose(0, 2, 3, 1)
        return np.ascontiguousarray(found.reshape(len(nodal), -1), dtype=np.float32)

    @cached_property
    def reader(self) -> FieldReader:
        """Reads stress and figures from displacements."""
        return FieldReader(self.mesh)

    @property
    def young(self) -> float:
        """Young's modulus of which `numbers` are, MPa."""
        return self.inputs.physics(self.study.middle)[0].young

    @cached_property
    def law(self) -> LawName:
        """The material's law: the solver's first where the study has none of its own."""
        return with_law(self.inputs.physics({})[0], make_solver(self.study.solver)).law

    @cached_property
    def error_modes(self) -> FloatArray:
        """Modes of paths whose squared lengths are mean squares of the displacement, (p, r, k)."""
        rows = self.space.vectors
        lengths = np.linalg.cholesky(rows @ rows.T / rows.shape[1])
        vectors = self.field.modes.vectors
        found = vectors.reshape(len(vectors), len(self.shares), -1) @ lengths
        return np.ascontiguousarray(found.transpose(0, 2, 1))


def places(inputs: Inputs, fingers: Sequence[Mapping[str, Value]]) -> FloatArray:
    """Inputs of fingers, shape (n, d): their parameters, the contact's place as it is half way.

    For what counts is where the indenter meets the ribs, and with its direction it goes along the finger.
    """
    moved = []
    for finger in fingers:
        if "contact_position" in finger:
            travel = inputs.physics(finger)[1].displacement[0] or 0.0
            finger = {**finger, "contact_position": float(finger["contact_position"]) + 0.5 * travel}
        moved.append(finger)
    return inputs.columns(moved)


def fitted_fields(shots: Snapshots, stages: Stages | None = None) -> FieldEmulator:
    """The emulator of fields, with intervals from samples that are each predicted from all others."""
    with (stages or Stages(quiet=True)).stage("emulator") as progress:
        known, inputs = shots.known, places(shots.known.inputs, shots.known.samples)
        count, strokes, nodes, _ = shots.nodal.shape
        space, coefficients = Modes.of_fields(shots.nodal.reshape(-1, nodes, 2), shots.space, LEAST)
        progress(0.2, f"{len(space.vectors)} modes of {count} paths")
        paths = coefficients.reshape(count, strokes, -1) / shots.shares[:, None]
        field = Block.fitted(inputs, *Modes.of(paths.reshape(count, -1), LEAST_OF_PATHS))
        progress(0.6, "force and contact")
        strength, numbers = _scaled(shots, inputs)
        units = np.abs(numbers).mean(axis=(0, 1)) + 1e-12
        block = Block.fitted(inputs, *Modes.of((numbers / units).reshape(count, -1), LEAST_OF_PATHS))
        progress(0.8, "mesh")
        motion = None
        if known.inputs.moves:
            motion = Block.fitted(inputs, *Modes.of(shots.points.reshape(count, -1), MOTION))
        progress(0.9, "intervals")
        ones = np.ones((strokes, 1 + len(FIGURES)))
        made = FieldEmulator(
            inputs=known.inputs,
            mesh=known.meshes.mesh,
            space=space,
            field=field,
            strength=strength,
            numbers=block,
            motion=motion,
            units=units,
            known=inputs,
            lost=places(known.inputs, known.lost),
            reasons=known.reasons,
            scales=ones,
            calibration=ones,
            errors=np.zeros(count),
        )
        return _calibrated(made, shots, paths)


def powers(inputs: FloatArray) -> FloatArray:
    """One, the inputs (..., d) and their products two by two, shape (..., p)."""
    first, second = np.triu_indices(inputs.shape[-1])
    one = np.ones_like(inputs[..., :1])
    return np.concatenate([one, inputs, inputs[..., first] * inputs[..., second]], axis=-1)


def _scaled(shots: Snapshots, inputs: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Coefficients of the strength, and the samples' numbers over it and powers of the stroke, (s, k, 5)."""
    numbers = shots.numbers / shots.shares[:, None] ** POWERS
    numbers[..., :3] /= shots.factors[:, None, None]
    forces = np.linalg.norm(numbers[:, numbers.shape[1] // 2, :2], axis=1)
    levels = np.log(np.maximum(forces, 1e-6 * forces.max()))
    terms = powers(inputs)
    penalty = RIDGE * np.eye(terms.shape[1])
    strength = np.linalg.solve(terms.T @ terms + penalty, terms.T @ levels)
    numbers[..., :3] /= np.exp(terms @ strength)[:, None, None]
    return strength, numbers


def _calibrated(made: FieldEmulator, shots: Snapshots, paths: FloatArray) -> FieldEmulator:
    """The emulator with its intervals."""
    known, (count, strokes, _) = shots.known, paths.shape
    path_errors = (made.field.left_out @ made.field.modes.vectors).reshape(paths.shape)
    number_errors = (made.numbers.left_out @ made.numbers.modes.vectors).reshape(count, strokes, -1)
    values = np.zeros((2, count, strokes, 1 + len(FIGURES)))
    indicators = np.zeros((count, strokes))
    reader, scales_of = made.reader, shots.factors * np.exp(powers(made.known) @ made.strength)
    for sample, finger in enumerate(known.samples):
        points = shots.points[min(sample, len(shots.points) - 1)]
        material, load = known.inputs.physics(finger)
        lame = material.model_copy(update={"young": made.young}).lame
        position = known.inputs.parameters(finger).contact_abscissa
        deviations = made.field.deviations(made.known[sample])
        for stroke, share in enumerate(shots.shares):
            indicators[sample, stroke] = made.indicator(deviations, np.eye(strokes)[stroke])
            true = shots.nodal[sample, stroke]
            path = share * (paths[sample, stroke] - path_errors[sample, stroke])
            guess = made.space.combined(path).reshape(-1, 2)
            scaled = shots.numbers[sample, stroke] / scales_of[sample] ** (POWERS > 0)
            missed = scaled - number_errors[sample, stroke] * made.units * share**POWERS
            for kind, nodal, numbers in ((0, true, scaled), (1, guess, missed)):
                stress = reader.stress(points, nodal, made.law, lame)
                figures = reader.figures(points, nodal, stress, position)
                values[kind, sample, stroke, 1:] = (stroke_axes(load)[0] @ numbers[:2], *figures, numbers[4])
            values[0, sample, stroke, 0] = np.sqrt(np.mean(true**2))
            values[1, sample, stroke, 0] = values[0, sample, stroke, 0] + np.sqrt(
                np.mean((guess - true) ** 2)
            )
    scales = np.sqrt((values[0] ** 2).mean(axis=0))
    off, expected = np.abs(values[1] - values[0]), scales * indicators[..., None]
    # Those from which the deviations are taken would have none.
    ratios = np.divide(off, expected, out=np.zeros_like(off), where=expected > 0)[made.field.landmarks :]
    relative = (values[1, :, -1, 0] - values[0, :, -1, 0]) / values[0, :, -1, 0]
    return replace(made, scales=scales, calibration=calibrated(ratios), errors=relative)


def _between(rows: FloatArray, shares: FloatArray, share: float) -> FloatArray:
    return np.array([np.interp(share, shares, column) for column in rows.T])
