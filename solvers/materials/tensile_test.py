"""Young's modulus under each law from a tensile test.

A bar in tension has a nominal stress in proportion to Young's modulus for a given Poisson's ratio, so that
the least-squares modulus is Σ s σ / Σ s² with the stress s of a bar of unit modulus. Its transverse stretch
is the one at which the transverse stress vanishes.
"""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.optimize import brentq

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.elasticity import LawName, lame_constants, stress_of
from pinnray.solvers.problem import Material

LAWS: tuple[LawName, ...] = ("linear", "neo-hookean", "st-venant-kirchhoff")
STRAINS = {"strain": 1.0, "strain_percent": 0.01, "strain_%": 0.01}
STRESSES = {"stress_MPa": 1.0, "stress_kPa": 1e-3, "stress_Pa": 1e-6}
"""Columns that are read, with the factor to a ratio and to MPa."""


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

    Laws are left out by which a bar cannot be stretched so far.
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
        fits.append(TensileFit(Material(young=young, poisson=poisson, law=law), misfit, young * unit))
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
    """Read a CSV file with a column of nominal strain and one of nominal stress, units in their names.

    Raises:
        UserError: If a column is missing, a cell is no number, or there are fewer than three points.
    """
    try:
        table = pd.read_csv(path, comment="#", sep=None, engine="python", skipinitialspace=True)
    except OSError as error:
        raise UserError(f"{path}: {error.strerror or error}") from None
    except (ValueError, csv.Error) as error:  # no table, or no text
        raise UserError(f"{path} is no table of a tensile test: {' '.join(str(error).split())}") from None
    columns = []
    for known in (STRAINS, STRESSES):
        name = next((each for each in table.columns if each in known), None)
        if name is None:
            there = ", ".join(map(str, table.columns))
            raise UserError(f"{path}: a column {' or '.join(known)} is needed; there is {there}")
        values = pd.to_numeric(table[name], errors="coerce").to_numpy(dtype=np.float64) * known[name]
        if not np.isfinite(values).all():
            row = int(np.flatnonzero(~np.isfinite(values))[0])
            raise UserError(f"{path}: {name} of row {row + 1} is {table[name][row]!r}, which is no number")
        columns.append(values)
    strain, stress = columns
    loaded = strain > 0
    if loaded.sum() < 3:
        raise UserError(f"{path}: three points or more with a strain above zero are needed")
    return TensileTest(strain[loaded], stress[loaded], str(path))
