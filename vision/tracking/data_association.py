"""Data association: assigns detections to markers, as the likeliest joint hypothesis of a smooth deformation.

The prior of the displacement is a Gaussian field that is fixed at the base. Markers are taken in the order of
their prior variance, which grows from the base on; each is one of the detections or missing, and its
detection conditions the field at the others. The likeliest joint hypotheses are kept (D. B. Reid, "An
algorithm for tracking multiple targets", IEEE TAC 24, 1979), and a detection is assigned only if almost all
of their weight agrees. Units: mm.
"""

import numpy as np
import shapely

from pinnray.geometry.section.section import Section
from pinnray.runtime.arrays import FloatArray, IntArray

HYPOTHESES = 256
"""Number of joint hypotheses that are kept."""
SURE = 0.999
"""Posterior probability from which a marker is assigned; below, it counts as missing."""
SEEN = 0.9
"""Prior probability that a marker is detected."""
FALSE_DENSITY = 1e-4
"""Density of detections that are no marker, 1/mm²."""
GATE = 5.0
"""Largest distance of a detection from its marker, in standard deviations."""
NOISE = 0.15
"""Standard deviation of errors outside the field: detection, and a wall that bulges between two ribs."""
SHARES = np.linspace(0, 1, 65)
"""Fractions of a piece of the base at which a line follows it."""
JUMPS = (1 / 16, 1.0)
"""Possible steps between frames, as multiples of the finger's usual whole stroke."""


def associate_markers(found: FloatArray, expected: FloatArray, fields: FloatArray) -> IntArray:
    """Assign detections to markers.

    Args:
        found: Detections in the finger's frame, shape (n, 2).
        expected: Predicted positions of the markers, shape (m, 2).
        fields: Covariances of the displacement from there along x and y, one for each possible size of step,
            shape (k, 2, m, m), mm²; see `step_covariances` and `rest_covariances`.

    Returns:
        The number of its detection for every marker, shape (m,); -1 where it is missing or not certain.
    """
    kinds, count = len(fields), len(expected)
    mean = np.repeat(expected.T[None], kinds, axis=0)
    covariance = fields.copy()
    weight = np.zeros(kinds)
    names = np.full((kinds, count), -1)
    free = np.ones((kinds, len(found)), dtype=bool)
    for marker in np.argsort(fields[-1, 1].diagonal(), kind="stable"):
        spread = covariance[:, :, marker, marker] + NOISE**2
        missed = found.T - mean[:, :, marker, None]
        square = (missed**2 / spread[:, :, None]).sum(axis=1)
        density = -0.5 * (square + np.log(2 * np.pi * spread).sum(axis=1)[:, None])
        allowed = free & (square < GATE**2)
        density = np.where(allowed, density + np.log(SEEN / FALSE_DENSITY), -np.inf)
        choices = weight[:, None] + np.column_stack([density, np.full(len(weight), np.log(1 - SEEN))])
        best = np.argsort(-choices, axis=None)[:HYPOTHESES]
        best = best[np.isfinite(choices.ravel()[best])]
        parent, chosen = np.unravel_index(best, choices.shape)
        weight, seen = choices[parent, chosen], chosen < len(found)
        mean, covariance, names, free = mean[parent], covariance[parent], names[parent], free[parent]
        names[seen, marker] = chosen[seen]
        free[seen, chosen[seen]] = False
        row = covariance[seen, :, marker]
        gain = row / spread[parent[seen], :, None]
        mean[seen] += gain * missed[parent[seen], :, chosen[seen]][:, :, None]
        covariance[seen] -= gain[..., None] * row[..., None, :]
    share = np.exp(weight - weight.max())
    agreed = (share[:, None] * (names == names[0])).sum(axis=0) / share.sum()
    return np.where(agreed >= SURE, names[0], -1)


def distance_from_base(section: Section, points: FloatArray) -> FloatArray:
    """Distance of points (m, 2), mm, from the clamped base, shape (m,), mm."""
    lines = [shapely.LineString(loop.along(which, SHARES)) for loop, which in section.named("base")]
    distances = shapely.distance(shapely.points(points)[:, None], np.array(lines))
    return np.asarray(distances.min(axis=1), dtype=np.float64)


def step_covariances(points: FloatArray, reach: FloatArray, jumps: tuple[float, ...] = JUMPS) -> FloatArray:
    """Covariances of a deformation between two frames, shape (len(jumps), 2, m, m), mm².

    The slope of v along the body is a random walk that starts at a hinge in the base; that of u too, but
    much smaller, and u follows the rotation of the section. The sizes exceed those of fingers that are
    pressed in by an eighth of their length, by `fem-nonlinear`. Points that are equally far from the base but
    on other branches, such as the two sides of a ring, move independently.

    Args:
        points: Markers at rest, shape (m, 2), mm.
        reach: Their distances from the base, shape (m,), mm.
        jumps: Sizes of the step, as multiples of the usual whole stroke.
    """
    length = reach.max()
    x, y = reach[:, None] / length, (points[:, 1:] - points[:, 1].mean()) / length
    aside = points[:, :1] / length - x
    same_branch = np.exp(-0.5 * ((aside - aside.T) / 0.8) ** 2)
    near = np.minimum(x, x.T)
    bend = near**2 * (3 * np.maximum(x, x.T) - near) / 6  # of a slope that is a random walk from zero
    v = (0.25**2 * x * x.T + 0.6**2 * bend) * np.exp(-0.5 * ((y - y.T) / 0.4) ** 2)
    u = 0.05**2 * x * x.T + 0.15**2 * bend + 0.2**2 * near * y * y.T
    return np.stack([jump**2 * length**2 * same_branch * np.stack([u, v]) for jump in jumps])


def rest_covariances(points: FloatArray) -> FloatArray:
    """Covariances at rest, shape (1, 2, m, m), mm²: a misalignment of the finger by 1 mm and 1 degree."""
    arms = (points[:, 1:], points[:, :1])
    return np.array([[1 + np.radians(1) ** 2 * arm @ arm.T for arm in arms]])


def with_predictions(points: FloatArray, reach: FloatArray, displacements: FloatArray) -> FloatArray:
    """Displacements with predictions of the field in place of nan, shape (m, 2), mm."""
    known = np.isfinite(displacements).all(axis=1)
    whole = displacements.copy()
    for axis, field in enumerate(step_covariances(points, reach, (1.0,))[0]):
        own = field[np.ix_(known, known)] + NOISE**2 * np.eye(known.sum())
        whole[~known, axis] = field[np.ix_(~known, known)] @ np.linalg.solve(own, displacements[known, axis])
    return whole
