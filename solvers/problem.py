"""The boundary-value problem: the argument of every solver, and nothing else."""

import hashlib
import json
from dataclasses import dataclass
from typing import Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from geometry.arrays import FloatArray
from geometry.errors import UserError
from geometry.mesh import TriangleMesh
from geometry.observations import Observations
from geometry.quadrature import edge_quadrature
from solvers.elasticity import Lame, LawName, lame_constants


class Material(BaseModel):
    """An isotropic elastic material.

    The defaults are those of the paper: Agilus30 and VeroUltra mixed to Shore 85A.

    Attributes:
        young: Young's modulus E, MPa.
        poisson: Poisson's ratio (the paper's μ).
        plane: Plane "strain" (thick finger) or plane "stress" (the equations that the paper prints).
        law: "linear" (Hooke), or one of finite strain: "neo-hookean" or "st-venant-kirchhoff".
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    young: float = Field(default=11.4, gt=0, description="Young's modulus, MPa")
    poisson: float = Field(default=0.45, gt=-1, lt=0.5, description="Poisson's ratio")
    plane: Literal["strain", "stress"] = "strain"
    law: LawName = "linear"

    @model_validator(mode="after")
    def _supported(self) -> Self:
        if self.law != "linear" and self.plane == "stress":
            raise ValueError(f"the {self.law} law is given for plane strain only; take plane = strain")
        return self

    @property
    def lame(self) -> Lame:
        """Lamé constants of the plane law, MPa."""
        return lame_constants(self.young, self.poisson, self.plane)


class Load(BaseModel):
    """What the indenter does to the boundary `contact`; a component that is None is free of force.

    Attributes:
        kind: `mean`: the weighted mean displacement over the contact is prescribed (`contact_weight`); well
            posed, the default. `point`: the displacement of the contact's middle node is prescribed, as in
            the paper; its limit under mesh refinement does not exist. `patch`: every point of the contact has
            the displacement.
        displacement: Prescribed (u, v), mm.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: Literal["mean", "point", "patch"] = "mean"
    displacement: tuple[float | None, float | None] = (0.0, -10.0)

    @model_validator(mode="after")
    def _acts(self) -> Self:
        if all(value is None for value in self.displacement):
            raise ValueError("the load leaves both components free; prescribe u, v or both (mm)")
        return self

    @property
    def prescribed(self) -> list[int]:
        """The components (0 for u, 1 for v) that are prescribed."""
        return [axis for axis, value in enumerate(self.displacement) if value is not None]

    @property
    def values(self) -> FloatArray:
        """The prescribed components' displacements, shape (1,) or (2,), mm."""
        return np.array([value for value in self.displacement if value is not None], dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Problem:
    """Find the displacement of the finger: clamped at `base`, moved at `contact`, free of traction elsewhere.

    Attributes:
        mesh: The mesh that every solver shares.
        material: The elastic law.
        load: What moves the finger.
        observations: Marker displacements, for the solvers that assimilate them.

    Raises:
        UserError: If part of the mesh is not connected to the base, so that it could move freely.
    """

    mesh: TriangleMesh
    material: Material = Material()
    load: Load = Load()
    observations: Observations | None = None

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

    @property
    def digest(self) -> str:
        """SHA-256 over everything that defines the problem."""
        sha = hashlib.sha256(self.mesh.digest.encode())
        sha.update(json.dumps([self.material.model_dump(), self.load.model_dump()], sort_keys=True).encode())
        if self.observations is not None:
            for name in ("points", "displacements", "standard_deviations", "visible"):
                sha.update(getattr(self.observations, name).tobytes())
        return sha.hexdigest()


def contact_extent(mesh: TriangleMesh) -> tuple[float, float]:
    """Middle abscissa and width of the contact, mm."""
    x = mesh.points[mesh.boundary("contact").ravel(), 0]
    return float(0.5 * (x.min() + x.max())), float(x.max() - x.min())


def contact_functional(problem: Problem) -> tuple[FloatArray, FloatArray]:
    """The linear functional of the load: prescribed = sum of weights times displacement at points.

    For `mean` the weight along the contact of width b, at distance s from its middle, is the raised cosine
    (1 + cos(2 pi s / b)) / b: smooth, zero at both ends, with integral one. For `point` it is the middle
    node.

    Returns:
        Points (q, 2), mm, and weights (q,) that sum to one.
    """
    mesh = problem.mesh
    if problem.load.kind == "point":
        return mesh.points[[mesh.contact_node]], np.ones(1)
    points, lengths = edge_quadrature(mesh, "contact")
    middle, width = contact_extent(mesh)
    weights = lengths * (1 + np.cos(2 * np.pi * (points[:, 0] - middle) / width)) / width
    return points, weights / weights.sum()
