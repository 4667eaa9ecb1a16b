"""Young's modulus under each law from a tensile test.

A bar in tension has a nominal stress in proportion to Young's modulus for a given Poisson's ratio, so that
the least-squares modulus is Σ s σ / Σ s² with the stress s of a bar of unit modulus. Its transverse stretch
is the one at which the transverse stress vanishes.
"""

import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.runtime.errors import UserError
from pinnray.runtime.tables import percent, read_table
from pinnray.solvers.elasticity import LawName, lame_constants, stress_of
from pinnray.solvers.problem import Material

LAWS: tuple[LawName, ...] = ("linear", "neo-hookean", "st-venant-kirchhoff")
UNITS = {
    "strain": {"": 1.0, "ratio": 1.0, "mm/mm": 1.0, "-": 1.0, "percent": 0.01, "%": 0.01},
    "stress_MPa": dict.fromkeys(("mpa", "n/mm2", "n/mm²", "n/mm^2"), 1.0)
    | {"kpa": 1e-3, "pa": 1e-6, "psi": 6.894757e-3},
}
"""Units of the columns that are read, in lower case, with the factor to a ratio and to MPa."""
WORDS = "strain|dehnung|d[ée]formation|ε", "stress|spannung|contrainte|σ"
TITLES = {
    name: rf"(?:(?:nominale?|engineering|eng\.?|tensile|axial|technische|zug)[\s_]*)*(?:{word})"
    r"(?:\s*\((?:extension|strain \d+)\))?[\s_/,]*(?:[ie]n\s+)?"
    rf"[(\[]?\s*(?P<unit>|{'|'.join(map(re.escape, UNITS[name]))})\s*[)\]]?"
    for name, word in zip(UNITS, WORDS, strict=True)
}
"""Titles of the columns, in English, German and French; those of true strain and stress are none."""
LIKELY_RATIO, MOST_RATIO = 1.5, 10.0
"""Strains beyond which a column without a unit may and must be per cent: no elastomer is drawn so far."""
FALL = 0.03
"""Fall of the stress, over its peak, from which on a test is not one rising curve."""


@dataclass(frozen=True, eq=False)
class TensileTest:
    """Nominal strain and nominal stress, MPa, of a bar in tension, both of shape (n,), in any order."""

    strain: FloatArray
    stress: FloatArray
    source: str = ""

    def up_to(self, strain: float) -> "TensileTest":
        """The part with strains up to one.

        Raises:
            UserError: If fewer than three points are left.
        """
        kept = self.strain <= strain
        if kept.sum() < 3:
            raise UserError(f"{kept.sum()} points have strains up to {strain:g}; three are needed")
        return TensileTest(self.strain[kept], self.stress[kept], self.source)

    def secant(self, strain: float) -> float:
        """Stress over strain at a strain, MPa, interpolated; NaN beyond the test."""
        order = np.argsort(self.strain)
        stress = np.interp(strain, self.strain[order], self.stress[order], left=np.nan, right=np.nan)
        return float(stress / strain)


@dataclass(frozen=True, eq=False)
class TensileFit:
    """A material fitted to a tensile test."""

    material: Material
    misfit: float  #: Root mean square of the stress that is missed, over that of the stress
    stress: FloatArray  #: Nominal, at the test's strains, shape (n,), MPa


def fitted(test: TensileTest, *, poisson: float = 0.45, laws: Sequence[LawName] = LAWS) -> list[TensileFit]:
    """The materials of some laws that are nearest to a tensile test, the best first.

    Laws are left out by which a bar cannot be stretched so far. The deviation of Young's modulus over it is
    the share of the stress that the law misses: at other strains the modulus is off by as much.
    """
    fits = []
    for law in laws:
        unit = nominal_stress(law, test.strain, poisson)
        if np.isnan(unit).any():
            continue
        young = float(unit @ test.stress / (unit @ unit))
        if not young > 0:
            raise UserError("the stress falls where the strain grows; see whether the columns are in order")
        missed = test.stress - young * unit
        misfit = float(np.sqrt((missed**2).mean() / (test.stress**2).mean()))
        made = Material(young=young, young_deviation=misfit * young, poisson=poisson, law=law)
        fits.append(TensileFit(made, misfit, young * unit))
    return sorted(fits, key=lambda fit: fit.misfit)


def nominal_stress(law: LawName, strain: FloatArray, poisson: float) -> FloatArray:
    """Nominal stress over Young's modulus, shape (n,), of a bar at nominal strains, shape (n,).

    NaN where there is no such bar: that of St Venant and Kirchhoff has no width left beyond a stretch of
    (1 + 1/ν)^½.
    """
    if law == "linear":
        return np.array(strain, dtype=np.float64)
    lame = lame_constants(1.0, poisson, "strain")

    def cauchy(along: float, across: float) -> tuple[float, float]:
        stress, _ = stress_of(law, np.diag([along - 1, across - 1, across - 1])[None], lame)
        return float(stress[0, 0, 0]), float(stress[0, 1, 1])

    found = np.full(len(strain), np.nan)
    for point, along in enumerate((1 + strain).tolist()):
        # From a bar with hardly any width to one that gains in width.
        narrow, wide = 0.01, 2.0
        if cauchy(along, narrow)[1] < 0 < cauchy(along, wide)[1]:
            across = brentq(lambda width, along=along: cauchy(along, width)[1], narrow, wide)
            found[point] = cauchy(along, across)[0] * across**2
    return found


def read_tensile_test(path: Path) -> TensileTest:
    """Read a table with a column of nominal strain and one of nominal stress, units in their titles.

    Of a test that goes back or falls, as after the break, the first loading up to the peak counts, with a
    warning.

    Raises:
        UserError: If a column or its unit is missing, a cell is no number, there are fewer than three points,
            or strains without a unit are too large for ratios.
    """
    table = read_table(path, "tensile test", TITLES)
    values = np.array(table.numbers()).reshape(-1, 2)
    strain, stress = values[np.isfinite(values[:, 0])].T
    strain = strain * _factor(path, "strain", table.titles["strain"])
    stress = stress * _factor(path, "stress_MPa", table.titles["stress_MPa"])
    loaded = strain > 0
    strain, stress = strain[loaded], stress[loaded]
    if strain.max(initial=0) > LIKELY_RATIO and _unit("strain", table.titles["strain"]) == "":
        ask = "are they per cent? Then call the column strain_percent, else strain_ratio"
        if strain.max() >= MOST_RATIO:
            raise UserError(f"{path}: strains up to {strain.max():g} are not ratios; {ask}")
        warnings.warn(f"{path}: strains up to {strain.max():g} have no unit; {ask}", stacklevel=2)
    kept = _first_loading(strain, stress)
    if kept.sum() < 3:
        raise UserError(f"{path}: three points or more of a loading with strains above zero are needed")
    if not kept.all():
        fault = "its strain goes back" if (np.diff(strain) < 0).any() else "its stress falls after the peak"
        warnings.warn(
            f"{path}: {fault}; of its {len(kept)} points the {kept.sum()} of the loading up to the peak "
            f"count, to a strain of {percent(float(strain[kept].max()))} and {stress[kept].max():.4g} MPa",
            stacklevel=2,
        )
    return TensileTest(strain[kept], stress[kept], str(path))


def _unit(name: str, title: str) -> str:
    found = re.fullmatch(TITLES[name], title, re.I)
    return found["unit"].lower() if found else ""


def _factor(path: Path, name: str, title: str) -> float:
    """Factor of a column to a ratio or to MPa, by the unit in its title."""
    if (unit := _unit(name, title)) not in UNITS[name]:
        raise UserError(f"{path}: the column {title!r} says no unit; call it {name}, or with another unit")
    return UNITS[name][unit]


def _first_loading(strain: FloatArray, stress: FloatArray) -> BoolArray:
    """Points of the first loading up to the peak of the stress; all if they lie on one rising curve.

    Args:
        strain: In the order of the test or, on one curve, in any other, shape (n,).
        stress: Likewise.
    """
    along = stress[np.argsort(strain, kind="stable")]
    falls = np.maximum.accumulate(along) - along
    if not falls.max(initial=0) > FALL * stress.max(initial=0):
        return np.ones(len(strain), dtype=bool)
    ahead = strain > np.maximum.accumulate(np.append(0.0, strain[:-1]))
    peak = int(np.where(ahead, stress, -np.inf).argmax())
    return np.asarray(ahead & (np.arange(len(strain)) <= peak))
