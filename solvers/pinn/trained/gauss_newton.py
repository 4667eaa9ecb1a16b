"""Gauss-Newton's method for networks of more weights than a matrix can have.

It takes two kinds of steps, each along the line of least energy among a few lengths:

- of all n parameters, with the residuals r of a few points, m < n of them. By Woodbury's identity the damped
  step (J^T J + λ)^-1 J^T r = J^T (J J^T + λ)^-1 r needs a matrix of order m only. A sample that is drawn anew
  for each step, larger each time, brings random weights close to the solution in a few steps; then the
  difference between sample and body limits them.
- of some of the parameters, drawn anew for each step, with the gradient over all points. The matrix comes
  from a sample, and sets the direction only: the steps end where the gradient over all points vanishes.

Sources: J. Müller, M. Zeinhofer: Achieving high accuracy with PINNs via energy natural gradient descent, ICML
2023; A. Guzmán-Cordero, F. Dangel, G. Goldshlager, M. Zeinhofer: Improving energy natural gradient descent
through Woodbury, momentum, and randomization, arXiv:2505.12149 (2025), for the first; F. Roosta-Khorasani,
M. W. Mahoney: Sub-sampled Newton methods, Math. Program. 174 (2019) 293-326, for the second.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import torch

from geometry.arrays import FloatArray
from solvers.pinn.threading import map_in_threads, slices
from solvers.pinn.trained.squares import Sample, Squares

FIRST_DAMPING, LATER_DAMPING = 1e-3, 1e-4
"""Of the first step of each kind, over the mean diagonal entry of its matrix."""

LENGTHS = (1.0, 0.5, 0.25, 0.1, 0.03)
"""Lengths of a step that are tried."""

DAMPINGS = (0.25, 1.0, 4.0)
"""Factors of the damping that are tried in every `RETRY`-th step."""

RETRY = 4
REFUSED = 8.0
"""Factor of the damping after a step that found no less energy."""

COLUMNS = 512
"""Columns of a matrix product that a thread takes at once."""


class TrainingStep(NamedTuple):
    """State after a step."""

    parameters: torch.Tensor  # Shape (2, parameters)
    value: float  # Energy and misfit there, N mm/mm
    damping: float  # As a share of the matrix' mean diagonal entry
    length: float  # Of the step; zero if none was found


def sampled_steps(
    squares: Squares, start: torch.Tensor, points: int, steps: int, seed: int
) -> Iterator[TrainingStep]:
    """Steps of all parameters, from samples that grow evenly to `points` points."""
    draw, now = Draw(squares.body, seed), TrainingStep(start, squares.value(start), FIRST_DAMPING, 0.0)
    every = torch.arange(start.shape[1]).expand(2, -1)
    for number in range(steps):
        sample = draw.points(max(points * (number + 1) // steps, 1))
        slopes = squares.shift_slopes(now.parameters)
        body = squares.jacobian(now.parameters, slopes, sample, every).flatten(1, 2)
        rows = torch.cat([body, squares.marker_jacobian(now.parameters, slopes, every)], dim=1)
        mixing = squares.mixing(len(sample))
        kernel = np.asarray(sum(mix @ (mix @ _gram(own)).T for mix, own in zip(mixing, rows, strict=True)))
        residuals = squares.residuals(now.parameters, sample).double().numpy()
        dual = _damped_solution(kernel, residuals, now.damping)
        direction = None
        if dual is not None:
            shares = (torch.from_numpy(mix.T @ dual).to(rows.dtype) for mix in mixing)
            direction = torch.stack([own.T @ share for own, share in zip(rows, shares, strict=True)])
        now = _next(squares, now, [(now.damping, direction)])
        yield now


def subset_steps(
    squares: Squares, start: torch.Tensor, chosen: int, points: int, steps: int, seed: int
) -> Iterator[TrainingStep]:
    """Steps of `chosen` parameters of each network, the matrix from `points` points."""
    draw, now = Draw(squares.body, seed), TrainingStep(start, squares.value(start), LATER_DAMPING, 0.0)
    for number in range(steps):
        _, gradient = squares.value_and_gradient(now.parameters)
        subset = draw.parameters(start.shape[1], chosen)
        matrix = squares.normal_matrix(now.parameters, draw.points(points), subset).numpy()
        right = gradient.gather(1, subset).double().flatten().numpy()
        tried = []
        for factor in DAMPINGS if number % RETRY == 0 else (1.0,):
            solution = _damped_solution(matrix, right, factor * now.damping)
            direction = None
            if solution is not None:
                entries = torch.from_numpy(solution).to(start.dtype).view(subset.shape)
                direction = torch.zeros_like(start).scatter_(1, subset, entries)
            tried.append((factor * now.damping, direction))
        now = _next(squares, now, tried)
        yield now


class Draw:
    """Random points and parameters, repeatable by seed."""

    def __init__(self, body: Sample, seed: int) -> None:
        """Draw from the points of a body, which should come in an order in which neighbours are close."""
        self._body, self._generator = body, torch.Generator().manual_seed(seed)
        self._order = torch.argsort(_along_a_curve(body.inputs[0, :, :2].double()))
        self._sums = body.weights[self._order].double().cumsum(0)

    def points(self, count: int) -> Sample:
        """`count` points of equal weight, spread over the area; all, with their own, if there are no more."""
        if count >= len(self._body):
            return self._body
        area = float(self._sums[-1])
        random = torch.rand(count, generator=self._generator, dtype=torch.float64)
        drawn = torch.searchsorted(self._sums, (torch.arange(count) + random) * (area / count))
        sample = self._body[self._order[drawn.clamp_max(len(self._order) - 1)]]
        return Sample(sample.inputs, sample.factor, torch.full_like(sample.weights, area / count))

    def parameters(self, parameters: int, count: int) -> torch.Tensor:
        """Numbers of `count` parameters of each network, ascending, shape (2, count)."""
        drawn = [torch.randperm(parameters, generator=self._generator)[:count] for _ in range(2)]
        return torch.stack(drawn).sort(dim=1).values


def _along_a_curve(points: torch.Tensor) -> torch.Tensor:
    """Places of points in [-1, 1]², (n, 2), on Morton's curve, which keeps neighbours close."""
    cells = ((points + 1) * 511.5).long().clamp(0, 1023)
    place = torch.zeros(len(points), dtype=torch.long)
    for bit in range(10):
        for axis in range(2):
            place |= ((cells[:, axis] >> bit) & 1) << (2 * bit + axis)
    return place


def _gram(rows: torch.Tensor) -> FloatArray:
    """Products of all rows, in double precision."""
    parts = map_in_threads(lambda part: rows @ rows[part].T, slices(len(rows), COLUMNS))
    return np.asarray(torch.cat(parts, dim=1).double().numpy())


def _damped_solution(matrix: FloatArray, right: FloatArray, damping: float) -> FloatArray | None:
    """Solution with damping added to a matrix' diagonal; None if that is not positive definite."""
    own = torch.from_numpy(matrix).clone()
    own.diagonal().add_(damping * float(own.diagonal().mean()))
    factor, failed = torch.linalg.cholesky_ex(own)
    if int(failed):
        return None
    return np.asarray(torch.cholesky_solve(torch.from_numpy(right)[:, None], factor)[:, 0].numpy())


def _next(
    squares: Squares, now: TrainingStep, tried: list[tuple[float, torch.Tensor | None]]
) -> TrainingStep:
    """The least energy along the directions that go with dampings; the damping grows if there is none."""
    best = now._replace(damping=now.damping * REFUSED, length=0.0)
    for damping, direction in tried:
        last = math.inf
        if direction is None:
            continue
        for length in LENGTHS:
            there = now.parameters - length * direction
            value = squares.value(there)
            if value < best.value:
                best = TrainingStep(there, value, damping, length)
            if value > last:
                break
            last = value
    return best
