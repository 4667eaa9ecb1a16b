"""The linear finger as a function of its parameters.

    K(θ) c = f_k b_k(θ),   b_k(θ) . c = d_k(θ)

    K = Σ_r s_r (λ L_r + μ M_r) + (E / ℓ) B           r: front wall, back wall, ribs, the rest

with stiffness factors s_r, matrices L_r and M_r of the two terms of the energy, and the mass matrix B of the
base, on which a layer of compliance ℓ (mm) answers a displacement u by the traction E u / ℓ. For a rigid
clamp its components are held instead.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.sparse import csc_matrix, diags, kron
from scipy.sparse.linalg import SuperLU, splu

from geometry.arrays import FloatArray
from geometry.mesh.boundary import walls_and_ribs
from geometry.mesh.quadrature import body_quadrature, edge_quadrature
from solvers.constrained_elimination import ConstrainedElimination
from solvers.elasticity import lame_derivatives
from solvers.fem.boundary_conditions import load_functionals
from solvers.fem.identification.linear_parameters import STIFFNESS, problem_with
from solvers.fem.identification.linear_response import Response
from solvers.lagrange import LagrangeSpace
from solvers.problem import Problem


class LinearModel:
    """Responses of a finger to a `mean` or `point` load; one factorisation while its stiffness stays.

    Args:
        problem: With the values of everything else.
        space: The elements.
        names: The parameters, keys of `solvers.fem.identification.linear_parameters.MEANINGS`.
    """

    def __init__(self, problem: Problem, space: LagrangeSpace, names: Sequence[str]) -> None:
        self._problem, self.space, self._names = problem, space, tuple(names)
        self._parts = _parts(space, any(name in STIFFNESS for name in names))
        self._free = np.ones((len(space.nodes), 2), dtype=bool)
        self._free[space.boundary_nodes("base")] = "base_compliance" in names
        self._base = _base_mass(space)
        self._factors: tuple[bytes, SuperLU] | None = None

    def close(self) -> None:
        """Free the factors."""
        self._factors = None

    def response(self, values: FloatArray) -> Response:
        """The response at parameters of shape (p,)."""
        named = dict(zip(self._names, map(float, values), strict=True))
        problem = problem_with(self._problem, named)
        body = self._stiffness(*problem.material.lame[:2], named)
        stiffness = body + self._layer(problem, named)
        self._factorise(stiffness)
        rows = load_functionals(problem, self.space)
        load = ConstrainedElimination(rows, np.array([self._solve(row) for row in rows]))
        nodal, forces = load.solution(np.zeros(self._free.shape), problem.load.values)

        def force_slope(name: str) -> FloatArray:
            slope = self._stiffness_slope(name, problem, named, stiffness)
            return np.asarray(slope @ nodal.ravel()).reshape(nodal.shape)

        energy = 0.5 * float(nodal.ravel() @ (body @ nodal.ravel()))
        return Response.of(
            problem, self.space, self._names, (nodal, forces, energy), self._solve, load, force_slope
        )

    def _stiffness(self, λ: float, μ: float, named: Mapping[str, float]) -> csc_matrix:
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
            return self._stiffness(slopes.λ, slopes.μ, named)
        if name in STIFFNESS:
            volume, shape = self._parts[STIFFNESS[name]]
            return material.lame.λ * volume + material.lame.μ * shape
        return csc_matrix(stiffness.shape)

    def _factorise(self, stiffness: csc_matrix) -> None:
        key = stiffness.data.tobytes()
        if self._factors is None or self._factors[0] != key:
            free = self._free.ravel()
            symmetric = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0}
            factors = splu(stiffness.tocsc()[free][:, free], **symmetric, options={"SymmetricMode": True})
            self._factors = key, factors

    def _solve(self, right: FloatArray) -> FloatArray:
        """K^-1 of nodal forces, both of shape (N, 2)."""
        solution = np.zeros_like(right)
        if self._factors is not None:
            solution[self._free] = self._factors[1].solve(right[self._free])
        return solution


def _parts(space: LagrangeSpace, separate: bool) -> dict[str, tuple[csc_matrix, csc_matrix]]:
    """Stiffness of every part of the body for λ = 1 and for μ = 1, rows u v u v ... of the nodes."""
    mesh = space.mesh
    rule = body_quadrature(mesh, 2 * space.degree - 2)
    dx, dy = space.shape_gradients(rule.location)
    u, v = [[1.0, 0.0]], [[0.0, 1.0]]
    volume, strains = kron(dx, u) + kron(dy, v), (kron(dx, u), kron(dy, v), kron(dy, u) + kron(dx, v))
    masks = walls_and_ribs(mesh) if separate else {}
    masks["rest"] = ~np.any([*masks.values(), np.zeros(len(mesh.triangles), dtype=bool)], axis=0)
    parts = {}
    for name, mask in masks.items():
        weights = diags(rule.weights * mask[rule.location.cells])
        xx, yy, xy = (strain.T @ weights @ strain for strain in strains)
        parts[name] = (volume.T @ weights @ volume).tocsc(), (2 * xx + 2 * yy + xy).tocsc()
    return parts


def _base_mass(space: LagrangeSpace) -> csc_matrix:
    """The integral of u . v over the base."""
    points, weights = edge_quadrature(space.mesh, "base")
    shapes = space.shape_functions(space.mesh.locate(points))
    return kron(shapes.T @ diags(weights) @ shapes, np.eye(2), format="csc")
