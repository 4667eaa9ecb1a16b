"""The boundary-value problem: the argument of every solver."""

from dataclasses import dataclass
from math import cos, radians, sin
from typing import Any, Literal, Self

import numpy as np
from pydantic import Field, field_validator, model_validator
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from geometry.arrays import FloatArray, IntArray
from geometry.content_hash import content_hash
from geometry.errors import UserError
from geometry.finger.finger import Finger
from geometry.finger.parameters import CheckedModel, bounded
from geometry.mesh.quadrature import segment_quadrature
from geometry.mesh.triangle_mesh import TriangleMesh
from geometry.observations import Observations
from solvers.elasticity import Lame, LawName, lame_constants

LoadKind = Literal["mean", "point", "patch", "cylinder"]

RADIUS = 5.0
"""Default radius of the cylinder, mm."""

ROUGHEST = 5.0
"""Largest coefficient of friction; that of rubber on rough ground is below."""

LEAST_TRAVEL = 1e-9
"""Smallest displacement of an indenter that moves, mm: a hundredth of an atom's size."""


def _number(default: float | None, low: float, high: float, unit: str, meaning: str, **limits: Any) -> Any:
    """A number with its unit, the ends of the range that a study may span, and the limits of pydantic."""
    return Field(
        default=default,
        description=meaning,
        json_schema_extra={"unit": unit, "low": low, "high": high},
        **limits,
    )


class Material(CheckedModel):
    """An isotropic elastic material; by default the paper's, Agilus30 and VeroUltra mixed to Shore 85A.

    A `UserError` says that a constant is out of its range, or that the law is not given for plane stress.
    """

    young: float = _number(11.4, 1e-6, 1e7, "MPa", "Young's modulus", gt=0)
    poisson: float = _number(0.45, -0.99, 0.4999, "", "Poisson's ratio", gt=-1, lt=0.5)
    #: Plane "strain" (thick finger) or plane "stress" (the equations that the paper prints)
    plane: Literal["strain", "stress"] = "strain"
    law: LawName = "linear"  #: "linear" is Hooke's law; the others are of finite strain

    @field_validator("young")
    @classmethod
    def _of_a_solid(cls, young: float) -> float:
        softest, stiffest = 1e-6, 1e7  # a thousandth of the softest gels' to eight times diamond's
        if not softest <= young <= stiffest:
            raise ValueError(
                f"no solid has this Young's modulus; give {softest:g} to {stiffest:g} MPa (1 MPa = 10^6 Pa)"
            )
        return young

    @model_validator(mode="after")
    def _supported(self) -> Self:
        if self.law != "linear" and self.plane == "stress":
            raise ValueError(f"the {self.law} law is given for plane strain only; take plane = strain")
        return self

    @property
    def lame(self) -> Lame:
        """Lamé constants of the plane law, MPa."""
        return lame_constants(self.young, self.poisson, self.plane)

    @property
    def solid_lame(self) -> Lame:
        """Lamé constants in three dimensions, MPa."""
        return lame_constants(self.young, self.poisson, "strain")


class Load(CheckedModel):
    """Displacement that the indenter prescribes at the boundary `contact`; a component None is free of force.

    Attributes:
        kind: `mean`: the weighted mean displacement over the contact is prescribed (`contact_functional`);
            well posed, the default. `point`: the displacement of the contact's middle node is prescribed, as
            in the paper; its limit under mesh refinement does not exist. `patch`: every point of the contact
            has the displacement. `cylinder`: a rigid cylinder, which does not turn and touches the front face
            at the contact's middle from outside, moves by the displacement; the contact zone is found.
        displacement: Prescribed (u, v), mm.
        position: Abscissa of the contact's middle on the front face, mm; None means where the mesh has its
            boundary `contact`, whose width the contact has in any case. A `patch` cannot be elsewhere.
        radius: Radius of the cylinder, mm; None for the other kinds.
        friction: Coulomb's coefficient of friction between cylinder and finger; 0 for the other kinds.

    Raises:
        UserError: If nothing is prescribed, a number is not finite, or a value does not go with the kind.
    """

    kind: LoadKind = "mean"
    displacement: tuple[float | None, float | None] = (0.0, -10.0)
    position: float | None = None
    radius: float | None = Field(default=None, gt=0, allow_inf_nan=False)
    friction: float = bounded(0.0, 0.0, ROUGHEST, "", "", "Coefficient of friction of a cylinder")

    @model_validator(mode="after")
    def _acts(self) -> Self:
        if all(value is None for value in self.displacement):
            raise ValueError("the load leaves both components free; prescribe u, v or both (mm)")
        if 0 < max(abs(value or 0.0) for value in self.displacement) < LEAST_TRAVEL:
            raise ValueError(
                f"the load moves the contact by less than {LEAST_TRAVEL:g} mm, a hundredth of an atom's "
                "size; give mm"
            )
        if self.kind == "patch" and self.position is not None:
            raise ValueError(
                "a patch lies on whole elements: mesh the finger with its contact_position there"
            )
        if (self.kind == "cylinder") != (self.radius is not None):
            raise ValueError("a radius belongs to the load cylinder, and to no other; give it in mm")
        if self.friction and self.kind != "cylinder":
            raise ValueError("friction belongs to the load cylinder, and to no other; leave it out")
        if self.kind == "cylinder" and None in self.displacement:
            raise ValueError("a cylinder is moved in u and v: the finger slides along it as friction lets it")
        if self.kind == "cylinder" and not any(self.displacement):
            raise ValueError("the cylinder does not move; prescribe a displacement (mm)")
        return self

    def as_mean(self) -> "Load":
        """The same displacement as the mean over a contact as wide as the drawn one."""
        return Load(displacement=self.displacement, position=self.position)

    @property
    def prescribed(self) -> list[int]:
        """The components (0 for u, 1 for v) that are prescribed."""
        return [axis for axis, value in enumerate(self.displacement) if value is not None]

    @property
    def values(self) -> FloatArray:
        """The prescribed components' displacements, shape (1,) or (2,), mm."""
        return np.array([value for value in self.displacement if value is not None], dtype=np.float64)


class Physics(Material):
    """Material and load by the names that options, files and studies share.

    The load is that of an indenter that travels in one direction.

    Raises:
        UserError: If the indenter does not press, or a value does not go with the kind of load.
    """

    load: LoadKind = "mean"  #: See `Load`
    stroke: float = _number(10.0, 1e-6, 1e4, "mm", "Travel of the indenter")
    #: 0 into the finger, 90 along it to the tip
    direction: float = _number(0.0, -89, 89, "deg", "Direction of the travel")
    slide: bool = False  #: Whether the contact slides along the finger: u is free
    radius: float | None = _number(None, 1e-6, 1e4, "mm", "Radius of a cylinder; none means 5 mm")
    friction: float = bounded(0.0, 0.0, ROUGHEST, "", "", "Coefficient of friction of a cylinder")

    @model_validator(mode="after")
    def _presses(self) -> Self:
        if self.stroke <= 0:
            raise ValueError(f"stroke {self.stroke:g}: the indenter presses; give its travel, above 0 mm")
        if not -90 < self.direction < 90:
            raise ValueError(f"direction {self.direction:g}: give an angle between -90 and 90 degrees")
        if self.slide and self.direction:
            raise ValueError("slide leaves the travel along the finger free, so that direction says nothing")
        return self

    @property
    def parts(self) -> tuple[Material, Load]:
        """Material and load."""
        along, into = sin(radians(self.direction)), cos(radians(self.direction))
        load = Load(
            kind=self.load,
            displacement=(None if self.slide else self.stroke * along, -self.stroke * into),
            radius=RADIUS if self.load == "cylinder" and self.radius is None else self.radius,
            friction=self.friction,
        )
        return Material(**self.model_dump(include=set(Material.model_fields))), load


@dataclass(frozen=True, eq=False)
class Problem:
    """Find the displacement of the finger: clamped at `base`, moved at `contact`, free of traction elsewhere.

    Raises:
        UserError: If part of the mesh is not connected to the base, if the contact is not on the front face,
            or if the load moves the contact of a finger farther than the finger is large.
    """

    mesh: TriangleMesh  #: Shared by all solvers
    material: Material = Material()
    load: Load = Load()
    observations: Observations | None = None  #: Marker displacements, for the solvers that assimilate them
    #: The meshed finger, for solvers that need more than the mesh, such as the thickness of a wall
    finger: Finger | None = None

    def __post_init__(self) -> None:
        count = len(self.mesh.points)
        first, second = self.mesh.edges.T
        graph = coo_matrix((np.ones(len(first)), (first, second)), shape=(count, count))
        _, part = connected_components(graph, directed=False)
        free = ~np.isin(part, part[self.mesh.boundary("base").ravel()])
        if free.any():
            x, y = self.mesh.points[free][0]
            raise UserError(
                f"part of the mesh is not connected to the base: {int(free.sum())} nodes, "
                f"one of them at ({x:.6g}, {y:.6g}) mm"
            )
        travel = float(np.linalg.norm(self.load.values))
        size = float(np.linalg.norm(np.ptp(self.mesh.points, axis=0)))
        if self.finger is not None and travel > size:  # A body of a closed form may have any unit.
            raise UserError(
                f"the load moves the contact by {travel:g} mm, farther than the finger is large "
                f"({size:.3g} mm); give mm"
            )
        left, right = contact_ends(self)
        said = f"the contact from x = {left:.6g} to {right:.6g} mm is not"
        front = self.mesh.points[self.mesh.boundary("front").ravel(), 0]
        slack = 1e-9 * (front.max() - front.min())
        if left < front.min() - slack or right > front.max() + slack:
            face = f"which runs from {front.min():.6g} to {front.max():.6g} mm"
            raise UserError(f"{said} on the front face, {face}")
        if (gap := _gap_in_front(self.mesh, left, right)) is not None:
            advice = "move the contact or make it narrower"
            raise UserError(f"{said} all on the front face, which has a gap at x = {gap:.6g} mm; {advice}")

    @property
    def digest(self) -> str:
        """SHA-256 over everything that defines the problem."""
        content: list[object] = [self.mesh.digest, self.material.model_dump(), self.load.model_dump()]
        if (seen := self.observations) is not None:
            content += [seen.points, seen.displacements, seen.standard_deviations, seen.visible]
            content += [seen.marker_radius, *vars(seen.pressed).values(), *vars(seen.drawn).values()]
        if self.finger is not None:
            content.append(self.finger.digest)
        return content_hash(content)


def contact_ends(problem: Problem) -> tuple[float, float]:
    """Abscissae of the contact's two ends, mm."""
    x = problem.mesh.points[problem.mesh.boundary("contact").ravel(), 0]
    if problem.load.position is None:
        return float(x.min()), float(x.max())
    half = 0.5 * (x.max() - x.min())
    return float(problem.load.position - half), float(problem.load.position + half)


def contact_nodes(problem: Problem) -> IntArray:
    """Nodes of the front face between the contact's ends and, if it has none there, the nearest."""
    left, right = contact_ends(problem)
    nodes = np.unique(problem.mesh.boundary("front"))
    outside = np.abs(problem.mesh.points[nodes, 0] - 0.5 * (left + right)) - 0.5 * (right - left)
    near = outside <= max(float(outside.min()), 1e-9 * (right - left))
    return np.asarray(nodes[near], dtype=np.int64)


def contact_functional(problem: Problem) -> tuple[FloatArray, FloatArray]:
    """The load's linear functional: points (q, 2), mm, and weights (q,), of sum one, of their displacements.

    For `mean` the weight along the contact of width b, at distance s from its middle, both along x, is the
    raised cosine (1 + cos(2 pi s / b)) / b: smooth, zero at both ends, with integral one. On a curved front
    it weighs true lengths and is scaled to the integral one. For `point` it is the middle node, or the point
    at `position`.
    """
    mesh, load = problem.mesh, problem.load
    if load.kind == "point" and load.position is None:
        return mesh.points[[mesh.contact_node]], np.ones(1)
    left, right = contact_ends(problem)
    middle, width = 0.5 * (left + right), right - left
    if load.kind == "point":
        return front_points(mesh, np.array([middle])), np.ones(1)
    count = 12  # points on an edge, enough if one edge holds the whole contact
    points, lengths = segment_quadrature(*_front_between(mesh, left, right), count)
    weights = lengths * (1 + np.cos(2 * np.pi * (points[:, 0] - middle) / width)) / width
    return points, weights / weights.sum()


def front_points(mesh: TriangleMesh, x: FloatArray) -> FloatArray:
    """Points of the front face at abscissae (n,), shape (n, 2), mm; a gap in it is bridged straight."""
    nodes = mesh.points[np.unique(mesh.boundary("front"))]
    nodes = nodes[nodes[:, 0].argsort()]
    return np.column_stack([x, np.interp(x, nodes[:, 0], nodes[:, 1])])


def _front_between(mesh: TriangleMesh, left: float, right: float) -> tuple[FloatArray, FloatArray]:
    """Ends, each (s, 2), mm, along x, of the pieces of the front's edges between two abscissae."""
    ends = mesh.points[mesh.boundary("front")]
    ends = np.take_along_axis(ends, ends[:, :, :1].argsort(axis=1), axis=1)
    ends = ends[ends[:, 0, 0].argsort()]
    start, end = ends[:, 0], ends[:, 1]
    length = end[:, :1] - start[:, :1]
    cuts = [np.clip((x - start[:, :1]) / length, 0, 1) for x in (left, right)]
    inside = (cuts[1] - cuts[0])[:, 0] > 1e-9
    first, last = (start + cut * (end - start) for cut in cuts)
    return first[inside], last[inside]


def _gap_in_front(mesh: TriangleMesh, left: float, right: float) -> float | None:
    """Start of the first gap of the front face between two abscissae, mm; None where it has none."""
    x = np.sort(mesh.points[mesh.boundary("front"), 0], axis=1)
    x = x[x[:, 0].argsort()]
    start, end = np.maximum.accumulate(x[:-1, 1]), x[1:, 0]
    slack = 1e-9 * np.ptp(x)
    gap = (end > start + slack) & (start < right - slack) & (end > left + slack)
    return float(max(start[gap][0], left)) if gap.any() else None
