"""Common printing filaments, resins and silicones of soft fingers.

The values are typical ones of the makers' data sheets. A printed part differs: raster, infill and age easily
change its modulus by a third, so that the tensile test of a printed strip is better (`tensile_test`).
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

from pinnray.runtime.errors import UserError
from pinnray.solvers.problem import Material, Substance

STRETCH = 2.0 - 2.0**-2
"""λ - λ⁻² at the strain of 100 %, of an incompressible neo-Hookean bar in tension."""


class MaterialPreset(NamedTuple):
    """An elastic material with what else a designer needs."""

    material: Material  #: Its elastic constants, for whatever law a solver has
    density: float  #: g/cm^3
    strain_at_break: float  #: Nominal strain
    source: str


def _young(stress: float) -> float:
    """Young's modulus, MPa, from the nominal stress at 100 % strain, MPa: E = 3 σ / (λ - λ⁻²)."""
    return round(3 * stress / STRETCH, 4)


TPU_LOSS = 0.1
"""Loss taken for printed TPU, from the errors of elastic finite elements on fin-ray fingers.

The material of these is not said. Their root mean square is 2.11 % of the largest force while loading and
4.34 % over the whole grasp (arXiv:2605.00307), so 5.8 % on a way back as long as the loading: in squares 5.4
% more. A force that is lower by a share of itself has a loss of 9 % then, one that is lower by a constant of
11 %. Of silicones no such number was found.
"""

TPU_SPREAD, SYLGARD_SPREAD = 0.2, 0.26
"""Standard deviations of Young's moduli over them.

Printed TPU has 100 to 146 MPa by the direction of its lines alone (Eng. Proc. 113 (2025) 19), and sources of
one filament differ by a factor of two: of logarithms that are all as likely within it, the deviation is
ln 2 / 12^½. That of Sylgard 184 is of the range that its source gives. Of the other silicones no spread was
found: their moduli count as exact.
"""

SMOOTH_ON = "Smooth-On, technical bulletin, 100 % modulus (ASTM D412)"
_SHEETS = (
    ("tpu-85a", 12.0, 0.45, 1.19, 6.6, "NinjaTek, NinjaFlex 85A, technical specifications (ASTM D638)"),
    ("tpu-95a", 26.0, 0.45, 1.22, 5.8, "NinjaTek, Cheetah 95A, technical specifications (ASTM D638)"),
    ("ecoflex-00-30", _young(0.0690), 0.49, 1.07, 9.0, f"{SMOOTH_ON}, Ecoflex 00-30, 10 psi"),
    ("ecoflex-00-50", _young(0.0827), 0.49, 1.07, 9.8, f"{SMOOTH_ON}, Ecoflex 00-50, 12 psi"),
    ("dragon-skin-10", _young(0.1517), 0.49, 1.07, 10.0, f"{SMOOTH_ON}, Dragon Skin 10, 22 psi"),
    ("dragon-skin-20", _young(0.3378), 0.49, 1.08, 6.2, f"{SMOOTH_ON}, Dragon Skin 20, 49 psi"),
    ("dragon-skin-30", _young(0.5929), 0.49, 1.08, 3.64, f"{SMOOTH_ON}, Dragon Skin 30, 86 psi"),
    (
        *("sylgard-184", 1.8, 0.49, 1.03, 1.0),
        "I. D. Johnston et al., J. Micromech. Microeng. 24 (2014) 035017: 1.32 to 2.97 MPa, cured at 25 to "
        "200 degrees; density and strain of Dow's data sheet",
    ),
)
"""Name, Young's modulus, MPa, Poisson's ratio, density, g/cm^3, nominal strain at break, and source."""

SPREADS = {"tpu-85a": TPU_SPREAD, "tpu-95a": TPU_SPREAD, "sylgard-184": SYLGARD_SPREAD}
LOSSES = {"tpu-85a": TPU_LOSS, "tpu-95a": TPU_LOSS}

MATERIALS: Mapping[str, MaterialPreset] = {
    name: MaterialPreset(
        Material(
            young=young,
            young_deviation=round(young * SPREADS.get(name, 0.0), 4),
            poisson=poisson,
            loss=LOSSES.get(name, 0.0),
        ).made_of(Substance(name, density, strain)),
        density,
        strain,
        source,
    )
    for name, young, poisson, density, strain, source in _SHEETS
}
"""The presets by name; Poisson's ratios are assumed, 0.45 of filaments and 0.49 of silicones."""


USUAL = ("young", "young_deviation", "poisson", "loss")
"""Constants that a preset has."""


def preset(name: str) -> MaterialPreset:
    """The preset of a name, also as makers write it: `TPU 85A` is `tpu-85a`.

    Raises:
        UserError: If there is none; it names those there are.
    """
    known = MATERIALS.get("-".join(name.lower().replace("_", " ").split()))
    if known is None:
        raise UserError(f"there is no material {name!r}; there are {', '.join(MATERIALS)}")
    return known


def of_preset(name: str, **given: Any) -> Material:
    """The material of a preset, of which some constants are other ones.

    Raises:
        UserError: If there is no such preset, or a constant is not admissible.
    """
    known = preset(name).material
    usual = {name: getattr(known, name) for name in USUAL}
    if "young" in given:  # of which the deviation is not the preset's
        del usual["young_deviation"]
    return Material(**usual | given).made_of(known.substance)
