"""Fits of printed dots, whose outlines are not quite elliptical.

Printing leaves an outline that deviates by some hundredths of the radius, and specks. The outline is fitted
as an ellipse with waves, and the centre is the centroid of its area, which a deformation of the finger
carries along. A partly hidden disc deviates as well: an outline must be that of a whole dot, and explain the
pixels better than an ellipse that leaves out what disagrees.
"""

from dataclasses import replace

import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray, IntArray
from pinnray.vision.discs import disc_image_model as model
from pinnray.vision.discs.correlated_noise import correlated_noise
from pinnray.vision.discs.disc_image_model import Array
from pinnray.vision.discs.fit_priors import MISSING, Known, prior_and_limits
from pinnray.vision.discs.least_squares import DiscFit, fit_disc_model, misfit, refined_fit
from pinnray.vision.discs.pixel_windows import PixelWindows
from pinnray.vision.discs.straight_edges import with_edges

PENALTY = 40.0
"""Gain in logarithmic likelihood from which on an irregular outline is preferred to an ellipse: half of the
logarithm of some hundred pixels for each of its parameters (G. Schwarz, "Estimating the dimension of a
model", Annals of Statistics 6, 1978)."""
REFINEMENTS = 3
"""Number of times that the pixels to use are chosen."""
EXCURSION = 0.3
"""Largest deviation of a printed dot's outline, over the radius."""
ROUGH = 0.06
"""Largest residual of a printed dot, root mean square over the contrast, without the noise."""
TAKEN_UP = 4.0
"""Noise of specks that outlines take up, over the excess that they leave; as on the virtual rig."""
LEAST_SEEN = 0.7
"""Share of an irregular outline that must support its fit."""
OTHER_SIZE = 5.0
"""Deviation of a known radius, in standard deviations, from which on a disc counts as partly hidden."""


def better_outlines(
    ellipses: DiscFit, start: FloatArray, window: PixelWindows, radii: FloatArray, known: Known
) -> tuple[IntArray, DiscFit, FloatArray]:
    """Fits of irregular outlines that explain the pixels better than ellipses do.

    Args:
        ellipses: Fits of ellipses, which leave out what disagrees.
        start: Parameters of fits that leave out less, shape (n, m).
        window: The pixels around the discs.
        radii: Known or guessed, shape (n,), pixels.
        known: Of the discs.

    Returns:
        The numbers of these discs, shape (k,), their fits, whose centres are the centroids of the outlines,
        and the noise that counts for them, as of `correlated_noise`.
    """
    outlines, residuals = _outlined(window, start, radii, known)
    noise = np.maximum(np.minimum(ellipses.variance, outlines.variance), window.noise**2)
    gain = misfit(window, ellipses.parameters, noise) - misfit(window, outlines.parameters, noise)
    good = _whole(window, outlines, radii, known.tolerance) & (gain > PENALTY)
    doubtful = ~(ellipses.settled & (ellipses.seen > LEAST_SEEN)) & ~good
    (tried,) = np.nonzero(doubtful)
    if len(tried):
        lenient, left = _outlined(window.at(tried), start[tried], radii[tried], known.at(tried), lenient=True)
        outlines.put(tried, lenient)
        residuals[tried] = left
        good[tried] = _whole(window.at(tried), lenient, radii[tried], known.tolerance)
    (better,) = np.nonzero(good)
    outlines, own = outlines.at(better), window.at(better)
    noise = correlated_noise(own, outlines, residuals[better], own.within, radii[better], known.at(better))
    noise += TAKEN_UP * np.maximum(noise - 1, 0)
    if np.isfinite(noise).any():
        noise = np.fmax(noise, np.nanmedian(noise, axis=0))
    parameters = outlines.parameters.copy()
    parameters[:, [model.X, model.Y]] += model.outline_centroid(parameters)
    columns = [*range(model.COUNT), *range(model.COUNT + model.OUTLINE, parameters.shape[1])]
    return better, replace(outlines, parameters=parameters[:, columns]), noise


def _whole(window: PixelWindows, outlines: DiscFit, radii: FloatArray, tolerance: float) -> BoolArray:
    """Whether outlines may be those of printed dots that nothing hides, shape (n,)."""
    excursion = np.abs(model.outline(outlines.parameters) - 1).max(axis=1)
    rough = np.sqrt(np.maximum(outlines.variance - window.noise**2, 0))
    likely = (excursion < EXCURSION) & (rough < ROUGH * np.abs(outlines.parameters[:, model.CONTRAST]))
    likely &= np.abs(outlines.parameters[:, model.RADIUS] / radii - 1) < OTHER_SIZE * tolerance
    return np.asarray(outlines.settled & (outlines.seen > LEAST_SEEN) & likely)


def _outlined(
    window: PixelWindows, start: FloatArray, radii: FloatArray, known: Known, *, lenient: bool = False
) -> tuple[DiscFit, Array]:
    """Fit discs with irregular outlines, from the moments of what circles leave of the darkness.

    A lenient fit takes the residuals for noise, however large they are, so that it leaves out few pixels.
    """
    start = start[:, : model.COUNT].copy()
    start[:, [model.STRETCH, model.SLANT]] = 0
    start[:, model.RADIUS] = radii
    start = np.concatenate([start, np.zeros((len(start), model.OUTLINE))], axis=1)
    for _ in range(2):
        start = _by_moments(window, start)
    start, present = with_edges(window, start, window.within)
    prior, limits = prior_and_limits(start, present, radii, known)
    plain = prior._replace(precision=prior.precision.copy())
    plain.precision[:, model.HALO] = MISSING**-2.0  # a halo is sought after the outline
    if lenient:
        return fit_disc_model(window, start, plain, limits, window.within, lenient=True)
    priors = [plain, *[prior] * (REFINEMENTS - 1)]
    return refined_fit(window, priors, start, limits, window.within)


def _by_moments(window: PixelWindows, start: FloatArray) -> FloatArray:
    """Improve discs by the moments of the residuals near their edges, which are shares of darkness astray."""
    levels, _ = model.disc_image(start.astype(np.float32), window.x, window.y)
    x, y, radius = start[:, [model.X, model.Y, model.RADIUS]].T
    near = np.abs(window.outside(start)) < EXCURSION * radius[:, None] + 2 * start[:, [model.BLUR]]
    contrast = np.copysign(np.maximum(np.abs(start[:, model.CONTRAST]), 1.0), start[:, model.CONTRAST])
    astray = np.clip((levels - window.values) / contrast[:, None], -1, 1) * (near & window.within)
    arms = (window.x - x[:, None] + 1j * (window.y - y[:, None])).astype(np.complex64)
    arms /= np.maximum(np.abs(arms), 1e-6)
    turned, sums = astray.astype(np.complex64), []
    for _ in range(model.LOBES.stop):
        sums.append(turned.sum(axis=1))
        turned *= arms
    waves = np.stack(sums, axis=1)
    even, odd = waves.real, waves.imag
    moved = start.copy()
    moved[:, model.X] += even[:, 1] / (np.pi * radius)
    moved[:, model.Y] += odd[:, 1] / (np.pi * radius)
    moved[:, model.RADIUS] += even[:, 0] / (2 * np.pi * radius)
    moved[:, model.COUNT : model.HALO : 2] += even[:, model.LOBES] / (np.pi * radius[:, None] ** 2)
    moved[:, model.COUNT + 1 : model.HALO : 2] += odd[:, model.LOBES] / (np.pi * radius[:, None] ** 2)
    return moved
