"""Material: elastic constants, the name of their law (see `elasticity`), and what the finger is made of."""

from collections.abc import Sequence
from typing import Any, Literal, NamedTuple, Self

from pydantic import Field, PrivateAttr, model_validator

from pinnray.geometry.finger.parameters import CheckedModel, bounded, value_and_deviation
from pinnray.runtime.errors import UserError

LawName = Literal["linear", "neo-hookean", "st-venant-kirchhoff", "gent"]
"""See `pinnray.solvers.elasticity`."""

PLANES = ("strain", "stress")


class Lame(NamedTuple):
    """Lamé constants, MPa."""

    λ: float  # As it stands in the law; in plane stress the reduced one, 2 λ μ / (λ + 2 μ)
    μ: float  # Shear modulus
    λ_out: float  # σ_zz over the trace of the in-plane strain: λ in plane strain, 0 in plane stress


def check_known(what: str, name: str, known: Sequence[str]) -> None:
    """Refuse a name, such as that of a law, with a `UserError` that lists the known ones."""
    if name not in known:
        raise UserError(f"the {what} {name!r} is not known here; take {' or '.join(known)}")


def lame_constants(young: float, poisson: float, plane: str) -> Lame:
    """Lamé constants from Young's modulus (MPa) and Poisson's ratio for plane "strain" or "stress"."""
    check_known("plane state", plane, PLANES)
    μ = young / (2 * (1 + poisson))
    if plane == "stress":
        return Lame(λ=young * poisson / ((1 + poisson) * (1 - poisson)), μ=μ, λ_out=0.0)
    λ = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    return Lame(λ=λ, μ=μ, λ_out=λ)


def lame_derivatives(young: float, poisson: float, plane: str) -> Lame:
    """Derivatives of the Lamé constants by Poisson's ratio, MPa."""
    check_known("plane state", plane, PLANES)
    μ = -young / (2 * (1 + poisson) ** 2)
    if plane == "stress":
        return Lame(λ=young * (1 + poisson**2) / (1 - poisson**2) ** 2, μ=μ, λ_out=0.0)
    λ = young * (1 + 2 * poisson**2) / ((1 + poisson) * (1 - 2 * poisson)) ** 2
    return Lame(λ=λ, μ=μ, λ_out=λ)


class Substance(NamedTuple):
    """What is known of a material besides its elasticity."""

    name: str
    density: float  #: g/cm^3
    strain_at_break: float  #: Nominal strain


class Material(CheckedModel):
    """An isotropic elastic material; by default the paper's, Agilus30 and VeroUltra mixed to Shore 85A.

    Young's modulus and Poisson's ratio go by their names or symbols: `Material(young=3, poisson=0.4)` equals
    `Material(E=3, nu=0.4)`. A `UserError` says that a constant is out of its range, or that the law is not
    given for plane stress.
    """

    #: From a thousandth of the softest gels' to eight times diamond's
    young: float = bounded(11.4, 1e-6, 1e7, "Young's modulus", "MPa", "E")
    #: Zero: known exactly. `Material(young="11.4±1.2")` has 1.2 MPa
    young_deviation: float = bounded(
        0.0, 0, 1e7, "Standard deviation of Young's modulus, which widens a force found from markers", "MPa"
    )
    poisson: float = bounded(0.45, -0.99, 0.4999, "Poisson's ratio", "", "nu", gt=-1, lt=0.5)
    plane: Literal["strain", "stress"] = Field(
        default="strain",
        description="Plane strain (a thick finger), or plane stress, whose equations the paper prints",
    )
    law: LawName = Field(
        default="linear", description="Material law of the solvers that have it; the others keep their own"
    )
    loss: float = bounded(
        0.0,
        0,
        0.9,
        "Share of the loading work that a cycle of loading and unloading loses; it is in the intervals of "
        "forces in films and in films of the rig, and in no equilibrium",
    )
    _substance: Substance | None = PrivateAttr(None)  # beside the constants, which alone decide a solution

    @model_validator(mode="before")
    @classmethod
    def _with_deviation(cls, values: Any) -> Any:
        """Young's modulus and its deviation out of a text such as `11.4±1.2` or `11.4+-1.2`."""
        if isinstance(values, dict) and isinstance(young := values.get("young"), str):
            value, deviation = value_and_deviation(young)
            if deviation:
                return values | {"young": value, "young_deviation": deviation}
        return values

    @model_validator(mode="after")
    def _supported(self) -> Self:
        if self.law != "linear" and self.plane == "stress":
            raise ValueError(f"the {self.law} law is given for plane strain only; take plane = strain")
        return self

    @property
    def substance(self) -> Substance | None:
        """What the finger is made of, where that is known."""
        return self._substance

    def made_of(self, substance: Substance | None) -> Self:
        """The same elastic constants, of a substance."""
        made = self.model_copy()
        made._substance = substance
        return made

    @property
    def lame(self) -> Lame:
        """Lamé constants of the plane law, MPa."""
        return lame_constants(self.young, self.poisson, self.plane)

    @property
    def solid_lame(self) -> Lame:
        """Lamé constants in three dimensions, MPa."""
        return lame_constants(self.young, self.poisson, "strain")
