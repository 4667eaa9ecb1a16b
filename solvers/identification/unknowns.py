"""The unknowns of the inverse problem, their priors, and the finger and contact that they describe."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil, log
from typing import NamedTuple

import numpy as np

from pinnray.geometry.finger.learned import Learned
from pinnray.geometry.mesh.wall_motion import WallMotion
from pinnray.geometry.picture_frame import PARTS, Pictures
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.assimilation.estimation import Parameter, Prior
from pinnray.solvers.assimilation.picture_frames import picture_parameters, pictures_of
from pinnray.solvers.contact.cylinder import FRICTION_STEP, touching_centre
from pinnray.solvers.elasticity import Lame, LawName, lame_derivatives
from pinnray.solvers.identification.boundary import Feet, FrontTraction
from pinnray.solvers.problem import Material, Problem, contact_ends

CONTACT = ("position", "width", "normal_force", "shear_force", "eccentricity")
SHARE = "shear_share"
"""Shear over normal force: it takes the place of `shear_force` where friction bounds it."""
INDENTATION = "indentation"
"""Mean displacement of the contact into the front: it takes the place of `normal_force` in a search, since a
force that falls while the finger is pressed farther cannot be prescribed."""
TRAVEL = 0.2
"""Standard deviation of the travel of a cylinder over the load's stroke."""
CYLINDER = ("position", "travel", "friction")
"""The unknowns of a cylinder, in place of those of `CONTACT`: friction along the way makes its force."""
WALLS = ("front_thickness", "back_thickness", "rib_thickness", "base_thickness")
DEFAULT = (*CONTACT, *WALLS, "base_compliance", "poisson", "feet")
"""What is found unless other names are given; the table of docs/how-to/force.md describes each. `feet` stands
for all motions of `pinnray.solvers.identification.boundary.Feet`."""
FINGER = (*WALLS, "base_compliance", "poisson", "young")
"""Those that belong to the finger, and not to a picture of it."""
LEAST_KNOWN = 0.3
"""Standard deviation of the logarithm of a Young's modulus of which nothing is said: a third."""


LAW_ODDS: Mapping[LawName, float] = {"neo-hookean": 150.0, "st-venant-kirchhoff": 1.0}
"""The laws of finite strain to choose from, with their odds before the markers are seen. Very strong evidence
(R. E. Kass, A. E. Raftery, Bayes factors, J. Am. Stat. Assoc. 90, 1995, 773-795: 150 to 1) is asked for a law
that no polymer follows: that of St Venant and Kirchhoff gives way in compression. Rubbers follow the
neo-Hookean law up to strains of 0.3 (L. R. G. Treloar, The physics of rubber elasticity, 3rd ed., 1975,
chapter 5), and in plane strain so does every incompressible body of Mooney and Rivlin, whose two invariants
are one there. With odds of 3 to 1, noise decided, and the force of a film was 12 % off."""
LAWS = tuple(LAW_ODDS)

CONTACT_ODDS = {"cylinder": 150.0, "patch": 1.0}
"""Odds of the contacts before the markers are seen: who gives a cylinder has seen it, so that very strong
evidence is asked for a patch, as for a law of `LAW_ODDS`."""


class Doubt(NamedTuple):
    """Deviations of a finger's force and stress from those of its model, as shares."""

    force: float
    stress: float
    corners: float = 0.0  # Of the force, for the roundings that a drawing leaves out

    @classmethod
    def of(cls, problem: Problem, *, weighed: bool) -> "Doubt":
        """Of a finger and its markers, which may have weighed plane strain against free side faces.

        Where they have not, are not known to be in plane strain and the finger has a depth, it is half of
        the difference between the moduli E / (1 - ν²) of plane strain and E of plane stress: a finger is in
        neither state.
        """
        seen, finger = problem.observations, problem.finger
        resolved = weighed or finger is None or (seen is not None and seen.plane)
        share = 0.5 * problem.material.poisson**2
        doubt = RESOLVED if resolved else cls(share, share)
        if finger is None or seen is None or seen.simulated:
            return doubt
        if seen.weighed or (problem.learned and problem.learned.weighed):  # the modulus makes up for it
            return RESOLVED
        sharp = not any(np.any(loop.bulges) for loop in finger.section.cavities)
        return doubt._replace(corners=CORNERS if sharp else 0.0)


RESOLVED = Doubt(0.01, 0.05)
"""Where the markers tell plane strain from free side faces, or there are none: what elements of 1 mm and few
functions of the depth leave on the default finger."""
CORNERS = 0.03
"""Where the cavities of a real finger are drawn with sharp corners: with roundings of 0.3 mm the force that
the markers of a default finger tell is 3 % larger."""


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A finger and a contact."""

    position: float  # Abscissa of the contact's middle, mm
    width: float  # Its length along x, mm
    force: FloatArray  # Of the indenter per depth, shape (2,), N/mm
    eccentricity: float  # Of the normal force from the middle, mm
    indentation: float  # Mean displacement of the contact into the front where the force follows from it, mm
    couple: FloatArray  # Normal force times its eccentricity, shape (2,), N: the dipole of the traction
    centre: FloatArray  # Of a cylinder where it touches the front, shape (2,), mm
    travel: FloatArray  # Of the cylinder from there, shape (2,), mm
    friction: float  # Its coefficient
    lame: Lame  # Lamé constants, MPa
    changes: FloatArray  # Of the walls' thickness, shape (k,), mm
    softness: float  # Compliance of the base over Young's modulus, mm/MPa
    feet: FloatArray  # Motions of the base's feet, shape (f,), mm and rad
    pictures: Pictures


class HypothesisSlopes(NamedTuple):
    """Derivatives of a hypothesis by the p unknowns, along the first axis; `moduli`, (p, 2), are λ and μ."""

    position: FloatArray
    width: FloatArray
    force: FloatArray
    eccentricity: FloatArray
    indentation: FloatArray
    couple: FloatArray
    centre: FloatArray
    travel: FloatArray
    friction: FloatArray
    moduli: FloatArray
    changes: FloatArray
    softness: FloatArray
    feet: FloatArray  # Shape (p, f)
    pressed: FloatArray  # By the values of the homographies, shape (p, 6)
    drawn: FloatArray


class Unknowns:
    """The p unknowns of a problem, in order, and the hypothesis that their values describe.

    Args:
        problem: It has the values of everything else; its load only gives the drawn contact, or a cylinder
            and its way, and the friction, its observations how well the frames of their pictures are known.
        names: Some of `DEFAULT`; a finger without cavities has no walls to be found, a base in one piece no
            feet. `young` joins them where it is known with a deviation, or a press was weighed or learned.

    Attributes:
        unregistered: True if the frame of a picture is to be found.
        place: Middle and length of the drawn contact, mm.
        directions: Unit vectors into the front face and along it where the contact is drawn, shape (2, 2).
        radius: Of the cylinder, mm.
    """

    def __init__(self, problem: Problem, names: Sequence[str]) -> None:
        self.problem = problem
        self.traction, self.motion = FrontTraction(problem.mesh), WallMotion.of(problem.mesh)
        self.feet = Feet(problem.mesh, held="feet" not in names)
        seen = problem.observations
        self.centre = np.zeros(2) if seen is None else seen.points.mean(axis=0)
        self._pictures = [] if seen is None else picture_parameters(seen)
        finger = [name for name in names if name not in (*WALLS, "feet") or name in self.motion.names]
        if problem.load.friction:
            finger = [SHARE if name == "shear_force" else name for name in finger]
        learned = problem.learned is not None and problem.learned.weighed > 0
        if problem.material.young_deviation or learned or (seen is not None and seen.weighed):
            finger.append("young")
        finger += self.feet.names
        self.names = (*finger, *(parameter.name for parameter in self._pictures))
        self.unregistered = bool(self._pictures)
        left, right = contact_ends(problem)
        self.place = 0.5 * (left + right), max(right - left, self.traction.longest)
        tx, ty = self.traction.tangent(self.place[0])
        self.directions = np.array([[ty, -tx], [tx, ty]])
        self.radius = float(problem.load.radius or 0.0)
        self._stroke = float(np.linalg.norm(problem.load.values))

    def _centre(self, position: float) -> FloatArray:
        """Of a cylinder that touches the front at an abscissa, mm; zero for another contact."""
        return touching_centre(self.problem, position) if "travel" in self.names else np.zeros(2)

    @property
    def stages(self) -> int:
        """Steps to the full travel, within each of which slip has one direction."""
        return max(4, ceil(self._stroke / (FRICTION_STEP * self.radius) - 1e-9))

    @property
    def _way(self) -> FloatArray:
        """Unit vector along it, shape (2,)."""
        return np.array([value or 0.0 for value in self.problem.load.displacement]) / self._stroke

    def parameters(self, flexibility: float, prior: float = 1.0) -> list[Parameter]:
        """The unknowns with their priors.

        Args:
            flexibility: Displacement of the drawn contact into the finger under a unit force, mm per N/mm.
            prior: Factor of the standard deviations of the priors.
        """
        front, material, friction = self.traction, self.problem.material, self.problem.load.friction
        middle, width = self.place
        modulus = material.young_deviation / material.young or LEAST_KNOWN
        # The force that would press the contact in by half of the front's extent.
        size = 0.5 * front.extent / flexibility
        # A contact narrower than half of the longest edge has too few points of quadrature.
        narrowest = 0.5 * front.longest
        known = [
            Parameter("position", "mm", middle, 0.05 * front.extent * prior, *front.ends),
            Parameter("width", "mm", width, log(2.5) * prior, narrowest, logarithmic=True),
            Parameter("normal_force", "N/mm", 0.0, size * prior),
            Parameter(INDENTATION, "mm", 0.0, 0.5 * front.extent * prior),
            Parameter("shear_force", "N/mm", 0.0, size * prior),
            Parameter("eccentricity", "mm", 0.0, 0.5 * width * prior),
            Parameter("travel", "mm", self._stroke, TRAVEL * self._stroke * prior, 0.1 * self._stroke),
            Parameter("friction", "", friction or 0.5, 0.3 * prior, 0.0, max(1.0, 2 * friction)),
            Parameter("base_compliance", "mm", 0.02, log(10) * prior, logarithmic=True),
            Parameter("poisson", "", material.poisson, 0.03 * prior, 0.0, 0.49),
            Parameter("young", "MPa", material.young, modulus * prior, logarithmic=True),
        ]
        for name, drawn in zip(self.motion.names, self.motion.thickness.tolist(), strict=True):
            # A printed wall is within 5 %; of the wall at the base the clamp may hold more or less.
            share = 0.25 if name == "base_thickness" else 0.05
            known.append(Parameter(name, "mm", drawn, share * drawn * prior, 0.5 * drawn, 2 * drawn))
        if friction:
            known.append(Parameter(SHARE, "", 0.0, friction * prior, -friction, friction))
        for name, tolerance in zip(self.feet.names, self.feet.tolerances.tolist(), strict=True):
            known.append(Parameter(name, "mm" if name.endswith("give") else "rad", 0.0, tolerance * prior))
        by_name = {parameter.name: parameter for parameter in [*known, *self._pictures]}
        return [by_name[name] for name in self.names]

    def prior(self, parameters: Sequence[Parameter]) -> Prior:
        """Of the standardised values of the unknowns, with what is learned of the finger."""
        learned, prior = self.problem.learned, Prior.independent(len(parameters))
        rows = [row for row, name in enumerate(self.names) if learned and name in learned.unknowns]
        if learned is None or not rows:
            return prior
        gained, pull = learned.information([self.names[row] for row in rows])
        scale = np.array([parameters[row].scale for row in rows])
        middle = np.array([parameters[row].middle for row in rows])
        precision, pulled = prior.precision.copy(), np.zeros(len(parameters))
        precision[np.ix_(rows, rows)] += gained * np.outer(scale, scale)
        pulled[rows] = scale * (pull - gained @ middle)
        return Prior(np.linalg.solve(precision, pulled), precision)

    def learned(
        self, parameters: Sequence[Parameter], z: FloatArray, covariance: FloatArray
    ) -> Learned | None:
        """What is known of the finger after another picture; None if nothing of it is unknown.

        Args:
            parameters: The unknowns.
            z: Their standardised values, shape (p,).
            covariance: Of those, shape (p, p).
        """
        before, seen = self.problem.learned, self.problem.observations
        rows = [row for row, name in enumerate(self.names) if name in FINGER]
        if not rows:
            return before
        own = covariance[np.ix_(rows, rows)]
        deviation = np.sqrt(np.diagonal(own))
        middle, scale = np.array([(parameters[row].middle, parameters[row].scale) for row in rows]).T
        return Learned(
            pictures=1 + (before.pictures if before else 0),
            weighed=int(bool(seen and seen.weighed)) + (before.weighed if before else 0),
            unknowns=tuple(self.names[row] for row in rows),
            mean=(middle + scale * z[rows]).tolist(),
            deviation=(scale * deviation).tolist(),
            drawn_mean=middle.tolist(),
            drawn_deviation=scale.tolist(),
            correlation=(own / np.outer(deviation, deviation)).tolist(),
        )

    def hypothesis(self, values: FloatArray, normal: float = 0.0) -> Hypothesis:
        """The finger and the contact of values, shape (p,), and of a normal force that is none of them."""
        named, material = {"normal_force": normal} | self._named(values), self.material(values)
        middle, width = self.place
        normal = named["normal_force"]
        sizes = normal, named.get("shear_force", 0.0) + named.get(SHARE, 0.0) * normal
        return Hypothesis(
            position=named.get("position", middle),
            width=named.get("width", width),
            force=np.array(sizes) @ self.directions,
            eccentricity=named.get("eccentricity", 0.0),
            indentation=named.get(INDENTATION, 0.0),
            couple=named.get("eccentricity", 0.0) * normal * self.directions[0],
            centre=self._centre(named.get("position", middle)),
            travel=named.get("travel", self._stroke) * self._way,
            friction=named.get("friction", self.problem.load.friction),
            lame=material.lame,
            changes=self.motion.changes(named),
            softness=named.get("base_compliance", 0.0) / material.young,
            feet=np.array([named.get(name, 0.0) for name in self.feet.names]),
            pictures=pictures_of(self.centre, named),
        )

    def slopes(
        self, values: FloatArray, normal: float = 0.0, by_normal: FloatArray | None = None
    ) -> HypothesisSlopes:
        """Derivatives of the hypothesis of values, shape (p,), and of a normal force with its own, (p,)."""
        named, material = {"normal_force": normal} | self._named(values), self.material(values)
        count = len(self.names)
        by: dict[str, FloatArray] = defaultdict(lambda: np.zeros(count))
        if by_normal is not None:
            by["normal_force"] = by_normal
        by |= zip(self.names, np.eye(count), strict=True)
        young, (λ, μ, _), into = material.young, material.lame, self.directions[0]
        by_poisson = lame_derivatives(young, material.poisson, material.plane)
        normal, eccentricity = named["normal_force"], named.get("eccentricity", 0.0)
        compliance = named.get("base_compliance", 0.0)
        along = by["shear_force"] + normal * by[SHARE] + named.get(SHARE, 0.0) * by["normal_force"]

        position, small = named.get("position", self.place[0]), 1e-4 * self.traction.extent
        ahead, behind = (self._centre(position + way * small) for way in (1, -1))
        centre_slope = (ahead - behind) / (2 * small)

        def stacked(names: Sequence[str]) -> FloatArray:
            """Derivatives (p, k) of k numbers, of which those that are no unknowns have none."""
            return np.array([by[name] for name in names]).reshape(-1, count).T

        return HypothesisSlopes(
            position=by["position"],
            width=by["width"],
            force=np.stack([by["normal_force"], along], axis=1) @ self.directions,
            eccentricity=by["eccentricity"],
            indentation=by[INDENTATION],
            couple=np.outer(normal * by["eccentricity"] + eccentricity * by["normal_force"], into),
            centre=np.outer(by["position"], centre_slope),
            travel=np.outer(by["travel"], self._way),
            friction=by["friction"],
            moduli=np.outer(by["young"], (λ / young, μ / young)) + np.outer(by["poisson"], by_poisson[:2]),
            changes=stacked(self.motion.names),
            softness=by["base_compliance"] / young - compliance / young**2 * by["young"],
            feet=stacked(self.feet.names),
            pressed=stacked([f"pressed_{part}" for part in PARTS]),
            drawn=stacked([f"drawn_{part}" for part in PARTS]),
        )

    def material(self, values: FloatArray) -> Material:
        """The material of values, shape (p,)."""
        named = self._named(values)
        changed = {name: value for name, value in named.items() if name in ("young", "poisson")}
        return self.problem.material.model_copy(update=changed)

    def _named(self, values: FloatArray) -> dict[str, float]:
        return dict(zip(self.names, map(float, values), strict=True))


def parse_unknowns(solver: str, text: str, sought: Sequence[str]) -> tuple[str, ...]:
    """The names in a text such as `position,normal_force`, of those that a solver seeks.

    Raises:
        UserError: If one is not known or is there twice, or there is no force among them.
    """
    names = tuple(name.strip() for name in text.split(",") if name.strip())
    for name in names:
        if name not in sought:
            raise UserError(f"{solver} has no parameter {name!r}; it has {', '.join(sought)}")
        if names.count(name) > 1:
            raise UserError(f"{solver}: the parameter {name!r} is there twice")
    if "normal_force" not in names:
        raise UserError(f"{solver} finds a force: give normal_force among the parameters")
    return names
