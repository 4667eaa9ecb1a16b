"""The linear finger as a function of its parameters, with exact derivatives of displacements and forces.

    K(θ) c = f_k b_k(θ),   b_k(θ) . c = d_k(θ)

    K = Σ_r s_r (λ L_r + μ M_r) + (E / ℓ) B           r: front wall, back wall, ribs, the rest

with stiffness factors s_r, matrices L_r and M_r of the two terms of the energy, and the mass matrix B of the
base, on which a layer of compliance ℓ (mm) answers a displacement u by the traction E u / ℓ. For a rigid
clamp its components are held instead. The derivative by a parameter, written ', costs one back-substitution:

    K c' - f_k' b_k = f_k b_k' - K' c,   b_k . c' = d_k' - b_k' . c
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import block_diag, bmat, csc_matrix, diags
from scipy.sparse.linalg import SuperLU, splu

from geometry.arrays import FloatArray
from geometry.mesh.quadrature import body_quadrature, edge_quadrature
from geometry.mesh.walls import walls_and_ribs
from solvers.constrained_elimination import ConstrainedElimination
from solvers.elasticity import lame_derivatives
from solvers.fem.boundary_conditions import load_functionals
from solvers.fem.identification.parameters import STIFFNESS, moved_functionals, problem_with, target_slope
from solvers.lagrange import LagrangeSpace
from solvers.problem import Problem


@dataclass(frozen=True, eq=False)
class Response:
    """What the finger does, and its derivatives by p parameters.

    Attributes:
        nodal: Displacements, shape (N, 2), mm.
        forces: At the prescribed components, shape (k,), N/mm.
        nodal_slopes: Shape (p, N, 2).
        force_slopes: Shape (p, k).
        energy: Elastic energy of the body per depth, N mm / mm; without that of the layer at the base.
    """

    nodal: FloatArray
    forces: FloatArray
    nodal_slopes: FloatArray
    force_slopes: FloatArray
    energy: float


class LinearModel:
    """Responses of a finger to a `mean` or `point` load; one factorisation while its stiffness stays.

    Args:
        problem: With the values of all that is no parameter.
        space: The elements.
        names: The parameters, keys of `solvers.fem.identification.parameters.MEANINGS`.
    """

    def __init__(self, problem: Problem, space: LagrangeSpace, names: Sequence[str]) -> None:
        self._problem, self._space, self._names = problem, space, tuple(names)
        self._parts = _parts(space, any(name in STIFFNESS for name in names))
        free = np.ones((len(space.nodes), 2), dtype=bool)
        free[space.boundary_nodes("base")] = "base_compliance" in names
        self._free = free.T.ravel()
        self._base = _base_mass(space)
        self._factors: tuple[bytes, SuperLU] | None = None

    def close(self) -> None:
        """Free the factors."""
        self._factors = None

    def response(self, values: FloatArray) -> Response:
        """The response at parameters of shape (p,)."""
        named = dict(zip(self._names, map(float, values), strict=True))
        problem = problem_with(self._problem, named)
        body, layer = self._stiffness(problem, named), self._layer(problem, named)
        self._factorise(body + layer)
        functionals = flat(load_functionals(problem, self._space))
        elimination = ConstrainedElimination.of(self._solve, functionals)
        nodal, forces = elimination.solution(np.zeros(self._free.size), problem.load.values)
        nodal_slopes = np.empty((len(named), nodal.size))
        force_slopes = np.empty((len(named), len(forces)))
        for row, name in enumerate(self._names):
            moved = flat(moved_functionals(name, problem, self._space))
            change = self._stiffness_slope(name, problem, named, body + layer) @ nodal
            nodal_slopes[row], force_slopes[row] = elimination.solution(
                self._solve(forces @ moved - change), target_slope(name, problem) - moved @ nodal
            )
        return Response(
            nodal=pairs(nodal),
            forces=forces,
            nodal_slopes=pairs(nodal_slopes),
            force_slopes=force_slopes,
            energy=0.5 * float(nodal @ (body @ nodal)),
        )

    def _stiffness(self, problem: Problem, named: Mapping[str, float]) -> csc_matrix:
        lame = problem.material.lame
        return self._sum(lame.λ, lame.μ, named)

    def _sum(self, λ: float, μ: float, named: Mapping[str, float]) -> csc_matrix:
        return sum(
            named.get(f"{part}_stiffness", 1.0) * (λ * volume + μ * shape)
            for part, (volume, shape) in self._parts.items()
        )

    def _layer(self, problem: Problem, named: Mapping[str, float]) -> csc_matrix:
        return problem.material.young / named.get("base_compliance", np.inf) * self._base

    def _stiffness_slope(
        self, name: str, problem: Problem, named: Mapping[str, float], stiffness: csc_matrix
    ) -> csc_matrix:
        """Derivative of the stiffness by a parameter."""
        material = problem.material
        if name == "young":
            return stiffness / material.young
        if name == "base_compliance":
            return self._layer(problem, named) / -named[name]
        if name == "poisson":
            slopes = lame_derivatives(material.young, material.poisson, material.plane)
            return self._sum(slopes.λ, slopes.μ, named)
        if name in STIFFNESS:
            volume, shape = self._parts[STIFFNESS[name]]
            return material.lame.λ * volume + material.lame.μ * shape
        return csc_matrix(stiffness.shape)

    def _factorise(self, stiffness: csc_matrix) -> None:
        key = stiffness.data.tobytes()
        if self._factors is None or self._factors[0] != key:
            free = stiffness.tocsc()[self._free][:, self._free]
            symmetric = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0}
            self._factors = key, splu(free, **symmetric, options={"SymmetricMode": True})

    def _solve(self, right: FloatArray) -> FloatArray:
        """K^-1 of a right-hand side of shape (2 N,)."""
        solution = np.zeros_like(right)
        if self._factors is not None:
            solution[self._free] = self._factors[1].solve(right[self._free])
        return solution


def _parts(space: LagrangeSpace, separate: bool) -> dict[str, tuple[csc_matrix, csc_matrix]]:
    """Stiffness of every part of the body for λ = 1 and for μ = 1, in the order u of all nodes, v of all."""
    mesh = space.mesh
    rule = body_quadrature(mesh, 2 * space.degree - 2)
    dx, dy = space.shape_gradients(rule.location)
    masks = walls_and_ribs(mesh) if separate else {}
    masks["rest"] = ~np.any([*masks.values(), np.zeros(len(mesh.triangles), dtype=bool)], axis=0)
    parts = {}
    for name, mask in masks.items():
        weights = diags(rule.weights * mask[rule.location.cells])
        xx, xy, yy = dx.T @ weights @ dx, dx.T @ weights @ dy, dy.T @ weights @ dy
        volume = bmat([[xx, xy], [xy.T, yy]], format="csc")
        shape = bmat([[2 * xx + yy, xy.T], [xy, xx + 2 * yy]], format="csc")
        parts[name] = volume, shape
    return parts


def _base_mass(space: LagrangeSpace) -> csc_matrix:
    """The integral of u . v over the base."""
    points, weights = edge_quadrature(space.mesh, "base")
    shapes = space.shape_functions(space.mesh.locate(points))
    mass = shapes.T @ diags(weights) @ shapes
    return block_diag([mass, mass], format="csc")


def flat(nodal: FloatArray) -> FloatArray:
    """From (k, N, 2) to (k, 2 N), all u first."""
    return nodal.swapaxes(1, 2).reshape(len(nodal), -1)


def pairs(flat: FloatArray) -> FloatArray:
    """From (..., 2 N) to (..., N, 2)."""
    return flat.reshape(*flat.shape[:-1], 2, flat.shape[-1] // 2).swapaxes(-2, -1)
