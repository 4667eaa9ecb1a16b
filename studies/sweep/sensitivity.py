"""Sobol' indices of the quantities: which parameter a quantity depends on.

A polynomial chaos expansion in Legendre polynomials is fitted by least squares to the samples; the indices
are sums of its squared coefficients. Sources: I. M. Sobol', Math. Comput. Simul. 55 (2001) 271-280;
B. Sudret, Reliab. Eng. Syst. Saf. 93 (2008) 964-979, section 4.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legvander

from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.runtime.tables import TextTable
from pinnray.studies.sweep.sampling import places_of
from pinnray.studies.sweep.sweep import Sweep

DEGREES = (1, 2, 3, 4, 5)
"""Total degrees that are tried; the one with the smallest left-out error is taken."""

PER_TERM = 2.0
"""Smallest number of samples per coefficient."""

TRUSTED = 0.9
"""Share of the variance, of samples left out of the fit, that the polynomial must explain."""


@dataclass(frozen=True)
class Sensitivity:
    """Sobol' indices of one quantity, as if all parameters varied independently over their ranges.

    Attributes:
        first: Share of the variance that each parameter causes alone, by its name.
        total: Share that it causes alone and with others.
        explained: Share of the variance of left-out samples that the polynomial explains.
    """

    first: Mapping[str, float]
    total: Mapping[str, float]
    explained: float


def sensitivities(sweep: Sweep, names: Sequence[str]) -> dict[str, Sensitivity]:
    """The indices of quantities; one that does not vary, or has too few samples, has none.

    Args:
        sweep: The sweep; its converged samples count.
        names: Of the quantities.
    """
    parameters = list(sweep.study.varied)
    rows = [places_of(sweep.study, sweep.samples[each.number]) for each in sweep.good]
    places = np.array(rows).reshape(-1, len(parameters))
    found = {}
    for name in names:
        values = np.array([each.values[name] for each in sweep.good])
        known = np.isfinite(values)
        if known.sum() <= PER_TERM * (1 + len(parameters)):
            continue
        if np.ptp(values[known]) > 1e-9 * np.abs(values[known]).max():
            found[name] = _indices(places[known], values[known], parameters)
    return found


def sensitivity_grid(found: Mapping[str, Sensitivity]) -> TextTable:
    """The indices of each quantity, %, and the share of its variance that the polynomials explain."""
    parameters = list(next(iter(found.values())).total) if found else []
    rows = [
        (
            name,
            *(f"{100 * each.total[key]:.0f} ({100 * each.first[key]:.0f})" for key in parameters),
            f"{100 * each.explained:.1f}{'' if each.explained >= TRUSTED else ' *'}",
        )
        for name, each in found.items()
    ]
    caption = (
        "Sobol' indices by polynomial chaos: the share of a quantity's variance that each parameter causes "
        "alone and with others (alone), if all vary independently over their ranges. Explained: by the "
        f"polynomials, at samples left out of the fit; below {100 * TRUSTED:.0f} % (*) do not trust the "
        "indices: run more samples."
    )
    return TextTable("Sensitivities, %", ["quantity", *parameters, "explained"], rows, caption)


def _indices(places: FloatArray, values: FloatArray, parameters: Sequence[str]) -> Sensitivity:
    """The indices from places (n, d) in the unit cube and values (n,)."""
    fits = []
    for degree in DEGREES:
        powers = _powers(len(parameters), degree)
        if PER_TERM * len(powers) > len(values):
            break
        fits.append((powers, *_fit(places, values, powers)))
    powers, coefficients, explained = max(fits, key=lambda fit: fit[2])
    share = coefficients**2
    share[0] = 0.0
    share /= share.sum()
    active = powers > 0
    alone = active.sum(axis=1) == 1
    first = [float(share[alone & active[:, axis]].sum()) for axis in range(len(parameters))]
    total = [float(share[active[:, axis]].sum()) for axis in range(len(parameters))]
    return Sensitivity(
        dict(zip(parameters, first, strict=True)), dict(zip(parameters, total, strict=True)), explained
    )


def _fit(places: FloatArray, values: FloatArray, powers: IntArray) -> tuple[FloatArray, float]:
    """Coefficients of the normalised polynomials, and the share of variance explained, leave-one-out."""
    degree = int(powers.max(initial=0))
    scale = np.sqrt(2 * np.arange(degree + 1) + 1)  # norm one for a uniform distribution
    one_axis: FloatArray = legvander(2 * places - 1, degree) * scale  # type: ignore[no-untyped-call]
    basis = np.prod([one_axis[:, axis, powers[:, axis]] for axis in range(places.shape[1])], axis=0)
    orthogonal, triangle = np.linalg.qr(basis)
    coefficients = np.linalg.solve(triangle, orthogonal.T @ values)
    leverage = np.minimum((orthogonal**2).sum(axis=1), 1 - 1e-9)
    left_out = (values - basis @ coefficients) / (1 - leverage)
    return coefficients, float(1 - (left_out**2).mean() / values.var())


def _powers(dimensions: int, degree: int) -> IntArray:
    """Every combination of degrees with a total of at most `degree`, shape (terms, dimensions)."""
    from sklearn.preprocessing import PolynomialFeatures

    return np.asarray(PolynomialFeatures(degree).fit(np.zeros((1, dimensions))).powers_)
