"""A finger of a depth whose displacement is a few functions of z on the plane elements.

Between the middle plane, z = 0, and a side face without traction, z = h, the displacement is

    u, v = Σ_d f_d(z) c_d(x, y)  with f of 1, cosh(z/ℓ), cosh(z/m)        w: with f of z, sinh(z/ℓ), sinh(z/m)

even and odd in z, with the lengths ℓ and m of what a side face changes below it: 0.3 and 1 times the walls'
thickness. All f of u and v but the first one have the mean zero, so that their c_0 is the mean over the
depth. With the factors
t_md = (f_d, f_d, f'_d) of the derivatives along x, y and z, integrals over z come first and leave the
plane's: a tangent A_ijkl(x, y, z) gives for the functions d of component i and e of component k

    H_md,le(x, y) = ∫ t_md A_imkl t_le dz / h
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import ClassVar, NamedTuple

import numpy as np
from scipy.sparse import csr_matrix
from scipy.special import roots_legendre

from pinnray.geometry.mesh.boundary import mean_thickness
from pinnray.geometry.mesh.point_location import LocatedPoints
from pinnray.geometry.mesh.quadrature import body_quadrature
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.elasticity import Lame, deformation_jacobian, energy_density_of, piola_stress_and_tangent
from pinnray.solvers.fem.node_blocks import NodeBlocks
from pinnray.solvers.identification.body import Linearised
from pinnray.solvers.identification.unknowns import Unknowns
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.solvers.symmetric_factors import Factors

COMPONENT = np.array([0, 1, 0, 1, 0, 1, 2, 2, 2])
"""Number of the component, u, v or w, of each of the D functions of z."""
MEAN = np.array([1.0, 1.0, 0, 0, 0, 0, 0, 0, 0])
"""Their means over the depth."""
LENGTHS = 0.3, 1.0
"""ℓ and m over the walls' mean thickness. With them stresses of the side face of the default finger are 4 %
off those of ten layers of tetrahedra, with z² and one length 11 %, with z² and both 3 % for half as much
work again."""
INNER, LAYER = roots_legendre(3), roots_legendre(4)
"""Gauss' rules in the middle of the depth, and in the layer of two walls below a side face."""


class Functions(NamedTuple):
    """The D functions and their derivatives at places z, both of shape (z, D)."""

    values: FloatArray
    slopes: FloatArray

    @classmethod
    def of(cls, z: FloatArray, half: float, thickness: float) -> "Functions":
        """At places z, mm, for half of the depth and the walls' thickness, mm."""
        even = [(np.ones_like(z), np.zeros_like(z))]
        odd = [(z / half, np.full_like(z, 1 / half))]
        for length in thickness * np.array(LENGTHS):
            largest = np.cosh(half / length)
            mean = length / half * np.tanh(half / length)
            wave, slope = np.cosh(z / length) / largest, np.sinh(z / length) / largest
            even.append((wave - mean, slope / length))
            odd.append((slope, wave / length))
        rows = [each for each in even for _ in range(2)] + odd
        values, slopes = np.array(rows).transpose(1, 2, 0)
        return cls(values, slopes)


class Strained(NamedTuple):
    """The body at a state: q points of the plane and z places each."""

    gradient: FloatArray  # G, shape (q, z, 3, 3)
    inverse: FloatArray  # (I + ∇W)⁻¹, shape (q, 1, 3, 3)
    volume: FloatArray  # det(I + ∇W), shape (q, 1, 1, 1)

    def pulled_back(self, stress: FloatArray) -> FloatArray:
        """P conjugate to ∇u by the drawn position from the law's, both of shape (q, z, 3, 3), MPa."""
        return self.volume * stress @ self.inverse.swapaxes(-1, -2)


class ThickBody:
    """Half of a finger's depth on Lagrange elements; see `pinnray.solvers.identification.body.Body`.

    A state is the array of the coefficients c at the nodes, shape (N, D), mm. Forces are per depth, and act
    on the mean over it; markers are on a side face.
    """

    thick: ClassVar[bool] = True

    def __init__(self, unknowns: Unknowns, degree: int) -> None:
        problem = unknowns.problem
        assert problem.finger is not None  # it has a depth
        half, thickness = 0.5 * problem.finger.depth, mean_thickness(problem.mesh)
        below = max(half - 2 * thickness, 0.5 * half)
        ends = (INNER, 0.0, below), (LAYER, below, half)
        places = np.concatenate([a + 0.5 * (b - a) * (1 + x) for (x, _), a, b in ends])
        self._shares = np.concatenate([0.5 * (b - a) * w for (_, w), a, b in ends]) / half
        self._across, self._face = (Functions.of(z, half, thickness) for z in (places, np.array([half])))
        self._law, self.space = problem.material.law, LagrangeSpace(problem.mesh, degree)
        rule = body_quadrature(problem.mesh, 2)
        self._weights, self._elements = rule.weights, len(problem.mesh.triangles)
        # Derivatives along x and y, and values
        self._shapes = *self.space.shape_gradients(rule.location), self.space.shape_functions(rule.location)
        self._local = np.stack([each.data.reshape(len(rule.weights), -1) for each in self._shapes], axis=1)
        self._walls = np.zeros((len(unknowns.motion.names), len(rule.weights), 1, 3, 3))
        self._walls[..., 0, :2, :2] = unknowns.motion.gradients[:, rule.location.cells]
        base = self.space.boundary_nodes("base")
        self._free = ~np.isin(np.arange(len(self.space.nodes)), base)
        self.front = self.space.nodes[np.setdiff1d(self.space.boundary_nodes("front"), base)]
        self.shape = len(self.space.nodes), len(COMPONENT)
        self.feet = np.zeros((len(unknowns.feet.names), *self.shape))
        self.feet[:, base, :2] = unknowns.feet.motions(self.space.nodes[base])
        self._blocks = NodeBlocks.of(self.space)

    def admissible(self, state: FloatArray, changes: FloatArray) -> bool:
        """At the quadrature points; see `Body`."""
        return self._strained(state, changes) is not None

    def linearised(self, state: FloatArray, lame: Lame, changes: FloatArray) -> Linearised | None:
        """The force at a state and the tangent, which is factorised when it is first asked for."""
        if (there := self._strained(state, changes)) is None:
            return None
        stress, tangent = piola_stress_and_tangent(self._law, there.gradient, lame)

        @cache
        def factors() -> Factors:
            return self._factorised(tangent, there)

        def solve(right: FloatArray) -> FloatArray:
            flat = (right * self._free[:, None]).reshape(len(right), -1)
            return factors().solve(flat).reshape(right.shape)

        return Linearised(self._forces(there.pulled_back(stress)), solve, lambda: factors().negative)

    def force_slopes(
        self, state: FloatArray, lame: Lame, changes: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """By the walls, as for a network, by the moduli, in which every law is linear, and by the base."""
        there = self._strained(state, changes)
        assert there is not None  # nothing is inside out at an equilibrium
        gradient, inverse, _ = there
        stress, tangent = piola_stress_and_tangent(self._law, gradient, lame)
        of_walls, of_feet = np.zeros((len(self._walls), *self.shape)), np.zeros_like(self.feet)
        for found, wall in zip(of_walls, self._walls, strict=True):
            change = np.einsum("qzijkl,qzkl->qzij", tangent, -gradient @ wall @ inverse)
            change += np.trace(inverse @ wall, axis1=-2, axis2=-1)[..., None, None] * stress
            change -= stress @ (wall @ inverse).swapaxes(-1, -2)
            found[:] = self._forces(there.pulled_back(change))
        for found, foot in zip(of_feet, self.feet, strict=True):
            change = np.einsum("qzijkl,qzkl->qzij", tangent, self._gradient(foot) @ inverse)
            found[:] = self._forces(there.pulled_back(change))
        units = Lame(1.0, 0.0, 1.0), Lame(0.0, 1.0, 0.0)
        parts = (piola_stress_and_tangent(self._law, gradient, unit)[0] for unit in units)
        return of_walls, np.array([self._forces(there.pulled_back(part)) for part in parts]), of_feet

    def displacement_rows(self, points: FloatArray, weights: FloatArray) -> FloatArray:
        """On the side face; see `Body`."""
        return self._rows(weights @ self._functions_at(points), self._face.values[0])

    def traction_rows(self, points: FloatArray, weights: FloatArray) -> FloatArray:
        """Of the mean over the depth; see `Body`."""
        return self._rows(weights @ self._functions_at(points), MEAN)

    def gradient_rows(self, points: FloatArray, weights: FloatArray) -> FloatArray:
        """On the side face; see `Body`."""
        along = self.space.shape_gradients(self.space.mesh.locate(points))
        return self._rows(sum(weights[..., axis] @ along[axis] for axis in range(2)), self._face.values[0])

    def energy(self, state: FloatArray, lame: Lame, changes: FloatArray) -> float:
        """By quadrature; see `Body`."""
        if (there := self._strained(state, changes)) is None:
            return np.nan
        density = energy_density_of(self._law, there.gradient, lame)
        return float(self._weights * there.volume[:, 0, 0, 0] @ density @ self._shares)

    def field(self, state: FloatArray) -> "SideFace":
        """The displacement of the side face."""
        return SideFace(self, state)

    def displacements(self, states: FloatArray, location: LocatedPoints) -> FloatArray:
        """Displacements (s, n, 2) in the side face of states (s, N, D)."""
        functions = self.space.shape_functions(location)
        found = np.array([functions @ (state * self._face.values) for state in states])
        return np.stack([found[..., i == COMPONENT].sum(axis=-1) for i in range(2)], axis=-1)

    def gradients(self, states: FloatArray, location: LocatedPoints) -> FloatArray:
        """Displacement gradients (s, n, 3, 3) at the side face of states (s, N, D)."""
        shapes = *self.space.shape_gradients(location), self.space.shape_functions(location)
        return np.array([_gradient(shapes, state, self._face)[:, 0] for state in states])

    def _functions_at(self, points: FloatArray) -> csr_matrix:
        return self.space.shape_functions(self.space.mesh.locate(points))

    def _rows(self, values: FloatArray, shares: FloatArray) -> FloatArray:
        """Rows (r, 2, N, D) of u and v from rows (r, N) of a function, with the shares (D,) of c in them."""
        components = (np.arange(2)[:, None] == COMPONENT) * shares
        return np.asarray(np.einsum("rn,id->rind", np.asarray(values), components))

    def _gradient(self, state: FloatArray) -> FloatArray:
        """∂u_i/∂X_j at the quadrature points, shape (q, z, 3, 3)."""
        return _gradient(self._shapes, state, self._across)

    def _strained(self, state: FloatArray, changes: FloatArray) -> Strained | None:
        """None if a point is turned inside out."""
        motion = np.tensordot(changes, self._walls, axes=1)
        volume = deformation_jacobian(motion)
        if not (np.isfinite(state).all() and (volume > 0).all()):
            return None
        inverse = np.linalg.inv(np.eye(3) + motion)
        gradient = self._gradient(state) @ inverse
        inside_out = (deformation_jacobian(gradient) <= 0).any()
        return None if inside_out else Strained(gradient, inverse, volume[..., None, None])

    def _forces(self, stress: FloatArray) -> FloatArray:
        """F, shape (N, D), N/mm, of P at the quadrature points, (q, z, 3, 3), MPa; zero at the base."""
        weighted = (self._weights[:, None, None, None] * stress)[:, :, COMPONENT]
        along = self._across.values, self._across.values, self._across.slopes
        parts = [
            shape.T @ np.einsum("z,zd,qzd->qd", self._shares, function, weighted[..., axis])
            for axis, (shape, function) in enumerate(zip(self._shapes, along, strict=True))
        ]
        return np.asarray(sum(parts) * self._free[:, None])

    def _factorised(self, tangent: FloatArray, there: Strained) -> Factors:
        """Factors of the tangent's matrix, in blocks of the D functions of two nodes."""
        size, points = len(COMPONENT), len(self._weights)
        along = np.stack([self._across.values, self._across.values, self._across.slopes])
        found = np.empty((points, 3, 3, size, size))  # H
        for i, k in product(range(3), repeat=2):
            first, second = np.flatnonzero(i == COMPONENT), np.flatnonzero(k == COMPONENT)
            both = np.einsum("z,mzd,lze->mlzde", self._shares, along[..., first], along[..., second])
            part = tangent[:, :, i, :, k].transpose(2, 3, 0, 1) @ both.reshape(*both.shape[:3], -1)
            shape = points, 3, 3, len(first), len(second)
            found[..., first[:, None], second] = part.transpose(2, 0, 1, 3).reshape(shape)
        found *= (self._weights * there.volume[:, 0, 0, 0])[:, None, None, None, None]
        local = there.inverse.swapaxes(-1, -2)[:, 0] @ self._local  # derivatives after the walls' motion
        blocks = self._blocks.of_elements(
            local.reshape(self._elements, -1, *local.shape[1:]), found.reshape(self._elements, -1, size**2)
        )
        return self._blocks.matrix(blocks.reshape(-1, size, size), self._free).factorised(0.0, definite=False)


@dataclass(frozen=True, eq=False)
class SideFace:
    """The side face of a `ThickBody`; it is a `SolidField`."""

    body: ThickBody
    state: FloatArray

    def displacement(self, location: LocatedPoints) -> FloatArray:
        """Displacement in the face, shape (n, 2), mm."""
        return np.asarray(self.body.displacements(self.state[None], location)[0])

    def gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j in the face, shape (n, 2, 2)."""
        return self.solid_gradient(location)[:, :2, :2]

    def solid_gradient(self, location: LocatedPoints) -> FloatArray:
        """Displacement gradient du_i/dx_j, shape (n, 3, 3)."""
        return np.asarray(self.body.gradients(self.state[None], location)[0])


def _gradient(shapes: Sequence[csr_matrix], state: FloatArray, across: Functions) -> FloatArray:
    """∂u_i/∂X_j (n, z, 3, 3) from matrices (n, N) of derivatives along x and y and of values."""
    dx, dy, own = (shape @ state for shape in shapes)
    parts = np.stack(
        [dx[:, None] * across.values, dy[:, None] * across.values, own[:, None] * across.slopes], axis=-1
    )
    return np.stack([parts[:, :, i == COMPONENT].sum(axis=2) for i in range(3)], axis=2)
