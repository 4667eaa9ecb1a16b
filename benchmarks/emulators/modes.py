"""Modes of a finger of which no solution is needed: vibrations, and their derivatives.

A mode's derivative along another is the second-order displacement that keeps the body free of force while it
moves along both: S. R. Idelsohn, A. Cardona, Computer Methods in Applied Mechanics and Engineering 49 (1985)
253-279. Without derivatives, walls that turn would have to stretch: 400 modes miss 90 % of the energy norm.
"""

from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np
from scipy.sparse import block_diag, bmat, diags
from scipy.sparse.linalg import eigsh, splu

from geometry.arrays import FloatArray, IntArray
from geometry.mesh.point_location import LocatedPoints
from solvers.elasticity import Lame
from solvers.lagrange import LagrangeSpace

ANGLES = ((0.445948490915965, 0.223381589678011), (0.091576213509771, 0.109951743655322))
"""Barycentric coordinate that two corners share, and weight, of Dunavant's rule of degree 4."""


@dataclass(frozen=True, eq=False)
class Rule:
    """Quadrature: places and weights, mm2."""

    where: LocatedPoints
    weights: FloatArray

    @classmethod
    def of(cls, space: LagrangeSpace, *, cells: IntArray | None = None, few: bool = False) -> "Rule":
        """Six points a triangle, or three."""
        mesh = space.mesh
        cells = np.arange(len(mesh.triangles)) if cells is None else cells
        pairs = ((1 / 6, 1 / 3),) if few else ANGLES
        corners = [np.where(np.eye(3), 1 - 2 * share, share) for share, _ in pairs]
        weights = np.repeat([weight for _, weight in pairs], 3)
        all_of = np.repeat(cells, len(weights))
        inside = np.tile(np.concatenate(corners), (len(cells), 1))
        points = np.einsum("qk,qkd->qd", inside, mesh.points[mesh.triangles[all_of]])
        where = LocatedPoints(points=points, cells=all_of, barycentric=inside)
        return cls(where, np.tile(weights, len(cells)) * mesh.areas[all_of])

    def gradients(self, space: LagrangeSpace, vectors: FloatArray) -> FloatArray:
        """Gradients of vectors (r, N, 2) at the places: shape (q, 2, 2, r)."""
        along = space.shape_gradients(self.where)
        found = np.array([[each @ vectors[:, :, axis].T for each in along] for axis in range(2)])
        return np.asarray(found.transpose(2, 0, 1, 3))


@dataclass(frozen=True, eq=False)
class FreeModes:
    """Vibrations of elastic energy 1/2, and derivatives along the first ones, one for each pair.

    Attributes:
        vibrations: Shape (r, N, 2).
        derivatives: Shape (p, N, 2), of elastic energy 1/2.
        sizes: Of the derivatives before that, shape (p,).
        pairs: Shape (p, 2).
    """

    vibrations: FloatArray
    derivatives: FloatArray
    sizes: FloatArray
    pairs: IntArray

    @classmethod
    def of(cls, space: LagrangeSpace, lame: Lame, count: int, coupled: int) -> "FreeModes":
        """The softest vibrations of a body that is held at its base."""
        rule = Rule.of(space)
        x, y = space.shape_gradients(rule.where)
        weight, values = diags(rule.weights), space.shape_functions(rule.where)
        stiff, shear = lame.λ + 2 * lame.μ, lame.μ
        across = lame.λ * x.T @ weight @ y + shear * y.T @ weight @ x
        stiffness = bmat(
            [
                [stiff * x.T @ weight @ x + shear * y.T @ weight @ y, across],
                [across.T, stiff * y.T @ weight @ y + shear * x.T @ weight @ x],
            ]
        ).tocsc()
        mass = block_diag([values.T @ weight @ values] * 2).tocsc()
        size = len(space.nodes)
        held = np.isin(np.arange(size), space.boundary_nodes("base"))
        free = np.flatnonzero(~np.tile(held, 2))
        inner = stiffness[free][:, free]
        squares, found = eigsh(inner, count, mass[free][:, free], sigma=0)
        flat = np.zeros((count, 2 * size))
        flat[:, free] = (found / np.sqrt(squares)).T
        factors = splu(inner.tocsc())

        def force(moved: FloatArray) -> FloatArray:
            nodal = moved.reshape(2, -1).T
            gradient = np.stack([x @ nodal, y @ nodal], axis=-1)
            stress = piola(gradient, lame) * rule.weights[:, None, None]
            return np.concatenate([x.T @ stress[:, axis, 0] + y.T @ stress[:, axis, 1] for axis in range(2)])

        small = [0.01 / np.abs(each).max() * each for each in flat[:coupled]]
        steps = [0.01 / np.abs(each).max() for each in flat[:coupled]]
        pairs = np.array(list(combinations_with_replacement(range(coupled), 2)))
        derivatives = np.zeros((len(pairs), 2 * size))
        for row, (one, other) in zip(derivatives, pairs, strict=True):
            both, apart = small[one] + small[other], small[one] - small[other]
            second = force(both) + force(-both) - force(apart) - force(-apart)
            row[free] = -factors.solve((second / (4 * steps[one] * steps[other]))[free])
        sizes = np.sqrt(np.einsum("ij,ij->i", derivatives, (stiffness @ derivatives.T).T))
        shaped = [
            each.reshape(-1, 2, size).transpose(0, 2, 1) for each in (flat, derivatives / sizes[:, None])
        ]
        return cls(shaped[0], shaped[1], sizes, pairs)


def piola(gradient: FloatArray, lame: Lame) -> FloatArray:
    """First Piola-Kirchhoff stress of the neo-Hookean law at gradients (q, 2, 2), MPa."""
    deformed = gradient + np.eye(2)
    volume = np.linalg.det(deformed)
    inverse = np.linalg.inv(deformed).transpose(0, 2, 1)
    return np.asarray(lame.μ * (deformed - inverse) + (lame.λ * np.log(volume))[:, None, None] * inverse)
