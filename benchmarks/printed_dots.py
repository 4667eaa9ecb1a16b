"""Sub-pixel centres of printed dots, which are not quite elliptical, beside a plain centroid of the darkness.

Dots with irregular outlines, light specks and disturbances of lens and camera, by the virtual rig, at random
places within a pixel; the truth is the centroid of the outline's area. Three minutes;
writes `docs/evidence/printed_dots.md`.
"""

import platform
from datetime import UTC, datetime
from importlib.metadata import version
from itertools import product
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from rich.table import Table

from geometry.arrays import BoolArray, FloatArray
from tests.vision.printed_dots import PrintedDots, darkness_centroids
from vision.discs import irregular_outlines
from vision.discs.disc_fit import FittedDiscs, fit_discs
from vision.rig.exposure import Exposure

REPORT = Path("docs/evidence/printed_dots.md")
SEED = 5
COUNT = 192
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
    """Measure and write the report."""
    rows = [_row(name, radius) for name, radius in product(CASES, RADII)]
    REPORT.write_text(_report(rows), encoding="utf-8")
    table = Table(*HEADER, title=f"{COUNT} printed dots each; {REPORT}")
    for row in rows:
        table.add_row(*row)
    return table


def _row(name: str, radius: float) -> tuple[str, ...]:
    dots = PrintedDots(radius, count=COUNT, seed=SEED, **CASES[name])
    picture, rng = dots.picture(), np.random.default_rng(SEED)
    guesses = np.column_stack(
        [
            dots.centres + rng.normal(0, 0.4, dots.centres.shape),
            radius * rng.uniform(0.9, 1.1, COUNT),
        ]
    )
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


def _report(rows: list[tuple[str, ...]]) -> str:
    lines = [
        "# Printed dots",
        "",
        f"Made by `python -m benchmarks dots` on {datetime.now(UTC):%Y-%m-%d}: {platform.machine()}, "
        f"Python {platform.python_version()}, numpy {version('numpy')}, seed {SEED}.",
        "",
        f"{COUNT} dots each at random places within a pixel, by the virtual rig: contrast of 129 grey "
        "levels, noise of 1, blur 0.8 px unless a row says otherwise. Irregular: root mean square "
        "deviation of the outline from a circle, over the radius. Errors are root mean square distances "
        "from the centroid of the outline's area; stated: the same of the reported standard deviations, "
        "and the share of the errors of a coordinate within 1.96 of them, 95 % if they are right, with the "
        f"standard deviation of a share of {2 * COUNT} coordinates. "
        "Ellipses: the same fit without irregular outlines; where it finds fewer, its error is that of the "
        "easier dots alone, to which the errors of the others are not to be compared. Centroid: of the "
        "darkness within 1.2 radii and 2 px, from the true place on.",
        "",
        "| " + " | ".join(HEADER) + " |",
        "|---|" + "---:|" * (len(HEADER) - 1),
        *("| " + " | ".join(row) + " |" for row in rows),
        "",
    ]
    return "\n".join(lines)
