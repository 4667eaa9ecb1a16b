"""Identification of the fiducials of a workspace among the discs in an image.

Four discs of one size and four fiducials with the same orientation define a homography. The one that maps
most fiducials to a disc of the right size is taken: some may be hidden, and there may be other discs. Units:
pixels, mm.
"""

from itertools import combinations, permutations
from typing import NamedTuple

import numpy as np

from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.runtime.errors import UserError
from pinnray.vision.tracking.workspace import Workspace

GATE = 2.0
"""Largest distance of a fiducial from its disc, mm, which includes an unknown lens distortion."""
SAME_SIZE = 1.3
"""Largest ratio of the radii of two fiducials."""
OBLIQUE = 1.6
"""Largest ratio of the scales in two directions, for a tilt of 50 degrees."""
MOST_DISCS = 16
"""Largest number of discs of one size that is searched."""
FLATTEST = 0.1
"""Smallest area of the triangles of four fiducials, as a share of the largest triangle's."""
LINE = 1e-3
"""Area of a triangle of three discs, over the square of the extent of all, below which they lie on a line."""


class UnseenError(UserError):
    """Too few fiducials are in the image."""


class FiducialMatch(NamedTuple):
    """Discs of the fiducials, shape (f,), -1 for those not found, and the sum of the residuals, mm.

    A residual is the distance of a disc from its fiducial and the difference of their radii.
    """

    discs: IntArray
    residual: float

    @property
    def found(self) -> int:
        """Number of fiducials that have a disc."""
        return int((self.discs >= 0).sum())


def identify_fiducials(pixels: FloatArray, radii: FloatArray, workspace: Workspace) -> IntArray:
    """Find the number of its disc for every fiducial, shape (f,); -1 where none was found.

    Args:
        pixels: Centres of discs, shape (n, 2); undistorted, if the camera is known.
        radii: Of the discs, shape (n,).
        workspace: The layout of the fiducials.

    Raises:
        UnseenError: If the discs show too few of the fiducials.
        UserError: If they show their mirror image.
    """
    straight = _best(pixels, radii, workspace, mirrored=False)
    mirrored = _best(pixels, radii, workspace, mirrored=True)
    wanted = len(workspace.fiducials)
    least = min(5, wanted)
    if mirrored.found >= least and mirrored.found > straight.found:
        raise UserError("the image is mirrored: the fiducials appear the wrong way round; flip it back")
    if straight.found < least:
        raise UnseenError(
            f"the workspace's {wanted} fiducials cannot be made out among {len(pixels)} discs: at "
            f"best {straight.found} fit, and {least} must; show them all, sharp and "
            "without much noise, or name the right workspace"
        )
    return straight.discs


def _best(pixels: FloatArray, radii: FloatArray, workspace: Workspace, *, mirrored: bool) -> FiducialMatch:
    """The best match of all sets of discs of about one size that may contain the fiducials."""
    best = FiducialMatch(np.full(len(workspace.fiducials), -1), np.inf)
    groups = {tuple((radii <= SAME_SIZE * radius) & (SAME_SIZE * radii >= radius)) for radius in radii}
    for group in sorted(groups):
        if not 4 <= sum(group) <= MOST_DISCS:
            continue
        discs = np.nonzero(group)[0]
        for match in _matches(pixels[discs], radii[discs], workspace, mirrored=mirrored):
            if (match.found, -match.residual) > (best.found, -best.residual):
                best = match._replace(discs=np.where(match.discs >= 0, discs[match.discs], -1))
    return best


def _matches(
    pixels: FloatArray, radii: FloatArray, workspace: Workspace, *, mirrored: bool
) -> list[FiducialMatch]:
    """The best match for every four fiducials that span the workspace."""
    world = workspace.points
    chosen = np.array(list(permutations(range(len(pixels)), 4)))
    turns = _triangles(pixels[chosen])
    turned = np.sign(np.where(np.abs(turns) < LINE * np.ptp(pixels, axis=0).max() ** 2, 0, turns))
    quads = np.array(list(combinations(range(len(world)), 4)))
    areas = _triangles(world[quads])
    matches = []
    for quad, area in zip(quads, areas, strict=True):
        if np.abs(area).min() < FLATTEST * np.abs(areas).max():
            continue
        # y is up in the plane and down in the image: what turns left there turns right here.
        fits = (turned == np.sign(area) * (1 if mirrored else -1)).all(axis=1)
        if fits.any():
            matches.append(_match(pixels, radii, workspace, world[quad], chosen[fits]))
    return matches


def _match(
    pixels: FloatArray, radii: FloatArray, workspace: Workspace, corners: FloatArray, chosen: IntArray
) -> FiducialMatch:
    """The best of the homographies that map `corners`, shape (4, 2), mm, to `chosen` discs, (s, 4)."""
    world = workspace.points
    homographies = _homographies(corners, pixels[chosen])
    mapped = np.einsum("sij,fj->sfi", homographies, np.column_stack([world, np.ones(len(world))]))
    in_front = (mapped[..., 2] > 0).all(axis=1)
    homographies, mapped = homographies[in_front], mapped[in_front]
    seen = mapped[..., :2] / mapped[..., 2:]
    jacobians = homographies[:, None, :2, :2] - seen[..., None] * homographies[:, None, 2:, :2]
    jacobians /= mapped[..., 2, None, None]
    area = np.abs(np.linalg.det(jacobians))
    upright = ((jacobians**2).sum(axis=(2, 3)) <= (OBLIQUE + 1 / OBLIQUE) * area).all(axis=1)
    if not upright.any():
        return FiducialMatch(np.full(len(world), -1), np.inf)
    scale = np.sqrt(area[upright, :, None])
    distance = np.linalg.norm(seen[upright, :, None] - pixels, axis=3) / scale
    size = radii / (scale * workspace.fiducial_diameter / 2)
    allowed = (distance < GATE) & (size < SAME_SIZE) & (size > 1 / SAME_SIZE)
    # Any four discs fit four fiducials, in any turn: then only the sizes tell which is which.
    distance = np.where(allowed, distance + np.abs(size - 1) * workspace.fiducial_diameter / 2, np.inf)
    nearest = distance.argmin(axis=2)
    residuals = distance.min(axis=2)
    count = np.isfinite(residuals).sum(axis=1)
    error = np.where(np.isfinite(residuals), residuals, 0.0).sum(axis=1)
    best = int(np.lexsort([error, -count])[0])
    found = np.isfinite(residuals[best])
    return FiducialMatch(np.where(found, nearest[best], -1), float(error[best]))


def _homographies(corners: FloatArray, images: FloatArray) -> FloatArray:
    """Homographies from four points, shape (4, 2), to their images, (s, 4, 2); shape (s, 3, 3)."""
    x, y = corners.T
    one, zero = np.ones(4), np.zeros(4)
    matrix = np.zeros((len(images), 8, 8))
    matrix[:, :4, :6] = np.stack([x, y, one, zero, zero, zero], axis=1)
    matrix[:, 4:, :6] = np.stack([zero, zero, zero, x, y, one], axis=1)
    matrix[:, :4, 6:] = -images[:, :, :1] * corners
    matrix[:, 4:, 6:] = -images[:, :, 1:] * corners
    right = images.transpose(0, 2, 1).reshape(-1, 8, 1)
    entries = np.linalg.solve(matrix, right)[..., 0]
    return np.column_stack([entries, np.ones(len(images))]).reshape(-1, 3, 3)


def _triangles(quads: FloatArray) -> FloatArray:
    """Twice the signed areas, shape (q, 4), of the four triangles of quadrangles, shape (q, 4, 2)."""
    a, b, c = (quads[:, corner] for corner in ([0, 0, 0, 1], [1, 1, 2, 2], [2, 3, 3, 3]))
    (p, q), (r, s) = np.moveaxis(b - a, -1, 0), np.moveaxis(c - a, -1, 0)
    return np.asarray(p * s - q * r)
