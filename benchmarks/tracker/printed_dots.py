"""Sub-pixel centres of printed dots, which are not quite elliptical, beside a plain centroid of the darkness.

Dots with irregular outlines, light specks and disturbances of lens and camera, by the virtual rig, at random
places within a pixel; the truth is the centroid of the outline's area. Three minutes;
writes `docs/evidence/printed_dots.md`.
"""

from itertools import product
from typing import Any
from unittest.mock import patch

import numpy as np
from rich.table import Table

from benchmarks.tables import DOCS, fill, made_by, markdown
from compare.runtime.tables import terminal_table
from geometry.arrays import BoolArray, FloatArray
from tests.vision.discs.printed_dots import PrintedDots, darkness_centroids
from vision.discs import irregular_outlines
from vision.discs.disc_fit import FittedDiscs, fit_discs
from vision.rig.exposure import Exposure

REPORT = DOCS / "evidence" / "printed_dots.md"
SEED, COUNT = 5, 192
RADII = (4.0, 7.3, 12.0)
IRREGULAR = (0.0, 0.03, 0.05, 0.08)


def _through(**changes: float) -> dict[str, Any]:
    return {"exposure": Exposure(**{"noise": 1.0, "gradient": 0.0, "monochrome": True, **changes})}


CASES: dict[str, dict[str, Any]] = {
    **{f"irregular by {share:.0%}": {"irregular": share} for share in IRREGULAR},
    "specks on 10 %": {"mottle": 0.1},
    "irregular 3 %, specks": {"irregular": 0.03, "mottle": 0.1},
    "sharpened by 1.5": _through(sharpen=1.5),
    "irregular 3 %, sharpened": {"irregular": 0.03, **_through(sharpen=1.5)},
    "irregular 3 %, blur 2 px": {"irregular": 0.03, **_through(blur=2.0)},
    "irregular 3 %, glare of 60": {"irregular": 0.03, **_through(glare=60.0)},
    "clipped white": _through(white=400.0),
    "irregular 3 %, clipped white": {"irregular": 0.03, **_through(white=400.0)},
    "irregular 3 %, clipped white, uneven light": {"irregular": 0.03, **_through(white=400.0, gradient=0.3)},
    "irregular 3 %, print layers of 10 %": {"irregular": 0.03, "layers": 0.1},
    "irregular 5 %, noise 6": {"irregular": 0.05, **_through(noise=6.0)},
}
HEADER = (
    *("dots", "radius, px", "found, %", "error, px", "stated, px", "1.96 sd, %"),
    *("ellipses: found, %", "error, px", "centroid: error, px"),
)


def main() -> Table:
    """Measure and write the page's table."""
    rows = [_row(name, radius) for name, radius in product(CASES, RADII)]
    fill(REPORT, "figures", f"{made_by('dots')}, seed {SEED}.\n\n{markdown(HEADER, rows)}")
    return terminal_table(f"{COUNT} printed dots each", HEADER, rows, left=["dots"])


def _row(name: str, radius: float) -> tuple[str, ...]:
    dots = PrintedDots(radius, count=COUNT, seed=SEED, **CASES[name])
    picture, rng = dots.picture(), np.random.default_rng(SEED)
    away, sizes = rng.normal(0, 0.4, dots.centres.shape), rng.uniform(0.9, 1.1, COUNT)
    guesses = np.column_stack([dots.centres + away, radius * sizes])
    discs = fit_discs(picture, guesses)
    with patch.object(irregular_outlines, "UNEVEN", 0.0):  # no outline is that of a printed dot
        ellipses = fit_discs(picture, guesses)
    errors, deviations = _errors(discs, dots), np.sqrt(np.diagonal(discs.covariances, axis1=1, axis2=2))
    deviations = deviations[discs.found]
    return (
        name,
        f"{radius:g}",
        f"{100 * discs.found.mean():.0f}",
        _rms(errors),
        _rms(deviations),
        _share(np.abs(errors) < 1.96 * deviations),
        f"{100 * ellipses.found.mean():.0f}",
        _rms(_errors(ellipses, dots)),
        _rms(darkness_centroids(picture, dots) - dots.centres),
    )


def _errors(discs: FittedDiscs, dots: PrintedDots) -> FloatArray:
    return np.asarray((discs.centres - dots.centres)[discs.found])


def _share(within: BoolArray) -> str:
    """Share in per cent, ± the standard deviation of a share of as many."""
    share = float(within.mean())
    # Half a success and half a failure are added: a share of all has a deviation as well.
    about = (within.sum() + 0.5) / (within.size + 1)
    return f"{100 * share:.0f} ± {100 * (about * (1 - about) / within.size) ** 0.5:.1f}"


def _rms(errors: FloatArray) -> str:
    """Root mean square distance; a dash if there is none."""
    return f"{np.sqrt((errors**2).sum(axis=1).mean()):.4f}" if len(errors) else "–"
