"""The unknowns of the inverse problem, their priors, and the finger and contact that they describe."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from geometry.arrays import FloatArray
from geometry.errors import UserError
from geometry.mesh.wall_motion import WallMotion
from solvers.assimilation.estimation import Parameter
from solvers.elasticity import Lame, lame_derivatives
from solvers.identification.traction import FrontTraction
from solvers.problem import Material, Problem, contact_ends

MEANINGS = {
    "position": "abscissa of the contact's middle",
    "width": "length of the contact along the finger",
    "normal_force": "force of the indenter into the front face, per depth",
    "tangential_force": "force of the indenter along the front face, toward the tip, per depth",
    "eccentricity": "distance of the normal force from the contact's middle, toward the tip",
    "front_thickness": "thickness of the front wall",
    "back_thickness": "thickness of the back wall",
    "rib_thickness": "thickness of the ribs",
    "base_thickness": "thickness of the wall at the base",
    "base_compliance": "how far the base gives under a traction of Young's modulus",
    "poisson": "Poisson's ratio",
    "young": "Young's modulus",
}
"""Every unknown, with its description."""

CONTACT = ("position", "width", "normal_force", "tangential_force", "eccentricity")
WALLS = ("front_thickness", "back_thickness", "rib_thickness", "base_thickness")
DEFAULT = (*CONTACT, *WALLS, "base_compliance", "poisson")

PLACE = 0.05
"""Standard deviation of the contact's place over the front's length."""
WIDTHS = log(2.5)
"""Standard deviation of the logarithm of the contact's width."""
NARROW = 0.5
"""Least width of the contact over the longest edge of the front, so that it has points of quadrature."""
REACH = 0.5
"""Displacement of the contact over the front's length, of which the force is the prior's deviation."""
TANGENTIAL = 1.0
"""Standard deviation of the tangential force over that of the normal one."""
ECCENTRICITY = 0.5
"""Standard deviation of the eccentricity over the drawn contact's width."""
PRINT = 0.05
"""Standard deviation of a printed wall's thickness over its drawn one."""
CLAMP = 0.25
"""The same for the wall at the base, of which the clamp may hold more or less."""
COMPLIANCE, COMPLIANCES = 0.02, log(10)
"""Median of the base's compliance, mm, and the standard deviation of its logarithm."""
POISSON, POISSON_LIMIT = 0.03, 0.49
"""Standard deviation of Poisson's ratio, and its upper bound."""


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A finger and a contact.

    Attributes:
        position: Abscissa of the contact's middle, mm.
        width: Its length along x, mm.
        force: Of the indenter per depth, shape (2,), N/mm.
        couple: Normal force times its eccentricity, shape (2,), N: the dipole of the traction.
        lame: Lamé constants, MPa.
        changes: Of the walls' thickness, shape (k,), mm.
        softness: Compliance of the base over Young's modulus, mm/MPa.
    """

    position: float
    width: float
    force: FloatArray
    couple: FloatArray
    lame: Lame
    changes: FloatArray
    softness: float


@dataclass(frozen=True, eq=False)
class Unknowns:
    """The p unknowns of a problem, in order, and what their values mean.

    Attributes:
        names: Keys of `MEANINGS`.
        problem: Its values are those of what is not unknown; without a force.
        traction: The front face.
        motion: The walls.
    """

    names: tuple[str, ...]
    problem: Problem
    traction: FrontTraction
    motion: WallMotion

    @classmethod
    def of(cls, problem: Problem, names: Sequence[str]) -> "Unknowns":
        """Those that the finger has; one without cavities has no walls to be found."""
        traction, motion = FrontTraction.of(problem.mesh), WallMotion.of(problem.mesh)
        kept = tuple(name for name in names if name not in WALLS or name in motion.names)
        return cls(kept, problem, traction, motion)

    @property
    def place(self) -> tuple[float, float]:
        """Middle and length of the drawn contact, mm."""
        left, right = contact_ends(self.problem)
        return 0.5 * (left + right), max(right - left, self.traction.resolution)

    @property
    def directions(self) -> FloatArray:
        """Unit vectors into the front face and along it where the contact is drawn, shape (2, 2)."""
        tx, ty = self.traction.tangent(self.place[0])
        return np.array([[ty, -tx], [tx, ty]])

    def parameters(self, flexibility: float, prior: float = 1.0) -> list[Parameter]:
        """The unknowns with their priors.

        Args:
            flexibility: Displacement of the drawn contact into the finger under a unit force, mm per N/mm.
            prior: Factor of the standard deviations of the priors.
        """
        material = self.problem.material
        middle, width = self.place
        low, high = self.traction.ends
        size = REACH * self.traction.length / flexibility
        least = NARROW * self.traction.resolution
        thickness = dict(zip(self.motion.names, self.motion.thickness.tolist(), strict=True))
        known = {
            "position": Parameter("position", "mm", middle, PLACE * self.traction.length * prior, low, high),
            "width": Parameter("width", "mm", width, WIDTHS * prior, least, logarithmic=True),
            "normal_force": Parameter("normal_force", "N/mm", 0.0, size * prior),
            "tangential_force": Parameter("tangential_force", "N/mm", 0.0, TANGENTIAL * size * prior),
            "eccentricity": Parameter("eccentricity", "mm", 0.0, ECCENTRICITY * width * prior),
            "base_compliance": Parameter(
                "base_compliance", "mm", COMPLIANCE, COMPLIANCES * prior, logarithmic=True
            ),
            "poisson": Parameter("poisson", "", material.poisson, POISSON * prior, 0.0, POISSON_LIMIT),
            "young": Parameter("young", "MPa", material.young, 0.3 * prior, logarithmic=True),
        }
        for name, drawn in thickness.items():
            share = CLAMP if name == "base_thickness" else PRINT
            known[name] = Parameter(name, "mm", drawn, share * drawn * prior, 0.5 * drawn, 2 * drawn)
        return [known[name] for name in self.names]

    def hypothesis(self, values: FloatArray) -> Hypothesis:
        """The finger and the contact of values, shape (p,)."""
        named, material = self._named(values), self.material(values)
        middle, width = self.place
        sizes = [named.get(name, 0.0) for name in ("normal_force", "tangential_force")]
        return Hypothesis(
            position=named.get("position", middle),
            width=named.get("width", width),
            force=np.array(sizes) @ self.directions,
            couple=named.get("eccentricity", 0.0) * sizes[0] * self.directions[0],
            lame=material.lame,
            changes=self.motion.changes(named),
            softness=named.get("base_compliance", 0.0) / material.young,
        )

    def material(self, values: FloatArray) -> Material:
        """The material of values, shape (p,)."""
        named = self._named(values)
        own = {name: named[name] for name in ("young", "poisson") if name in named}
        return self.problem.material.model_copy(update=own)

    def force_slopes(self) -> FloatArray:
        """Derivatives of the force by the unknowns, shape (p, 2)."""
        found = np.zeros((len(self.names), 2))
        for name, direction in zip(("normal_force", "tangential_force"), self.directions, strict=True):
            if name in self.names:
                found[self.names.index(name)] = direction
        return found

    def couple_slopes(self, values: FloatArray) -> FloatArray:
        """Derivatives of the couple by the unknowns, shape (p, 2)."""
        named, found = self._named(values), np.zeros((len(self.names), 2))
        if "eccentricity" in self.names:
            into = self.directions[0]
            found[self.names.index("eccentricity")] = named["normal_force"] * into
            found[self.names.index("normal_force")] = named["eccentricity"] * into
        return found

    def moduli_slopes(self, values: FloatArray) -> FloatArray:
        """Derivatives of λ and μ by the unknowns, shape (p, 2)."""
        material = self.material(values)
        found = np.zeros((len(self.names), 2))
        if "young" in self.names:
            λ, μ, _ = material.lame
            found[self.names.index("young")] = λ / material.young, μ / material.young
        if "poisson" in self.names:
            λ, μ, _ = lame_derivatives(material.young, material.poisson, material.plane)
            found[self.names.index("poisson")] = λ, μ
        return found

    def softness_slopes(self, values: FloatArray) -> FloatArray:
        """Derivatives of the softness of the base by the unknowns, shape (p,)."""
        named, young = self._named(values), self.material(values).young
        found = np.zeros(len(self.names))
        if "base_compliance" in self.names:
            found[self.names.index("base_compliance")] = 1 / young
            if "young" in self.names:
                found[self.names.index("young")] = -named["base_compliance"] / young**2
        return found

    def _named(self, values: FloatArray) -> Mapping[str, float]:
        return dict(zip(self.names, map(float, values), strict=True))


def parse_unknowns(solver: str, text: str) -> tuple[str, ...]:
    """The names in a text such as `position,normal_force`.

    Raises:
        UserError: If one is not known or is there twice, or there is no force among them.
    """
    names = parse_names(solver, text, tuple(MEANINGS))
    if "normal_force" not in names:
        raise UserError(f"{solver} finds a force: give normal_force among the parameters")
    return names


def parse_names(solver: str, text: str, known: Sequence[str]) -> tuple[str, ...]:
    """The names of parameters in a text such as `position,width`.

    Raises:
        UserError: If one is not known or is there twice, or there is none.
    """
    names = tuple(name.strip() for name in text.split(",") if name.strip())
    for name in names:
        if name not in known:
            raise UserError(f"{solver} has no parameter {name!r}; it has {', '.join(known)}")
        if names.count(name) > 1:
            raise UserError(f"{solver}: the parameter {name!r} is there twice")
    if not names:
        raise UserError(f"{solver} needs at least one parameter of {', '.join(known)}")
    return names
