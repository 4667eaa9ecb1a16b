"""Energy and markers' misfit of two networks, as half a sum of squares, with its derivatives by the weights.

The networks N give u = f (N + s): the factor f of `HardConstraint` is zero on the base, and the constants s
are such that the contact's displacement is the prescribed one, whatever the weights. With a linear law the
energy is half the sum of squares of three residuals at each quadrature point,

    E = 1/2 Σ_q w_q |R ∇u(x_q)|²        R^T R the stiffness, 4 x 4

and the misfit adds two residuals a marker (see `Misfit`).
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import torch
from scipy.sparse import bmat, csr_matrix, diags

from geometry.arrays import FloatArray
from geometry.mesh.quadrature import body_quadrature
from geometry.mesh.triangle_mesh import TriangleMesh
from solvers.assimilation.misfit import Misfit
from solvers.pinn.finite_basis.base_distance import HardConstraint
from solvers.pinn.paper.loss import stiffness_matrix
from solvers.pinn.paper.modified_mlp import ModifiedMlp
from solvers.pinn.threading import map_in_threads, slices
from solvers.pinn.trained.streams import Streams
from solvers.problem import Problem, contact_functional

PIECE = 512
"""Points that a thread takes at once."""


@dataclass(frozen=True, eq=False)
class NetworkFrame:
    """What the networks see of a point: its scaled position, and the factor of the clamped base."""

    origin: torch.Tensor  # Position that is scaled to zero, shape (2,), mm
    half: float  # Length that is scaled to one, mm
    constraint: HardConstraint  # The factor f

    @classmethod
    def of(cls, mesh: TriangleMesh, base_length: float) -> Self:
        """The frame of a body: the larger side of its box goes from -1 to 1."""
        low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
        constraint = HardConstraint.of(mesh, base_length)
        return cls(torch.tensor((low + high) / 2), float((high - low).max() / 2), constraint)

    def sample(self, points: torch.Tensor, weights: torch.Tensor, dtype: torch.dtype) -> "Sample":
        """The points (n, 2), mm, with weights (n,), as the networks see them."""
        inputs = torch.zeros(3, len(points), 3, dtype=points.dtype)
        inputs[0, :, :2] = (points - self.origin) / self.half
        inputs[0, :, 2] = 1
        inputs[1, :, 0] = inputs[2, :, 1] = 1 / self.half
        factor = torch.cat(self.constraint.at(points), dim=1)
        return Sample(inputs.to(dtype), factor.to(dtype), weights.to(dtype))


@dataclass(frozen=True, eq=False)
class Sample:
    """Points with weights."""

    inputs: torch.Tensor  # Streams of the scaled position and of one, shape (3, n, 3)
    factor: torch.Tensor  # f and its derivatives by x and y, shape (n, 3)
    weights: torch.Tensor  # Shape (n,), mm² in the body

    def __len__(self) -> int:
        return len(self.weights)

    def __getitem__(self, rows: slice | torch.Tensor) -> "Sample":
        """Some of the points."""
        return Sample(self.inputs[:, rows], self.factor[rows], self.weights[rows])

    def displacement(self, output: torch.Tensor, shift: torch.Tensor) -> torch.Tensor:
        """u, du/dx and du/dy from the networks' outputs (2, 3, n) and constants (2,): (2, 3, n)."""
        factor, slopes = self.factor[:, 0], self.factor[:, 1:].T
        value = output[:, :1] + shift[:, None, None]
        return torch.cat([factor * value, factor * output[:, 1:] + slopes * value], dim=1)

    @property
    def gradient_factors(self) -> torch.Tensor:
        """Factors of the networks' streams in du/dx and du/dy, shape (2, n, 3)."""
        factors = self.factor.new_zeros(2, len(self), 3)
        for axis in range(2):
            factors[axis, :, 0] = self.factor[:, 1 + axis]
            factors[axis, :, 1 + axis] = self.factor[:, 0]
        return factors


@dataclass(frozen=True, eq=False)
class Squares:
    """Half the sum of squares, of parameters of shape (2, parameters)."""

    shape: ModifiedMlp  # Of the networks
    frame: NetworkFrame  # What they see
    body: Sample  # Quadrature points; their weights are areas
    contact: Sample  # Points of the contact; their weights give its displacement
    # Displacement of the contact, shape (2,), mm; a component that is free has the value NaN
    prescribed: torch.Tensor
    stiffness: FloatArray  # Of the displacement gradient (du/dx, du/dy, dv/dx, dv/dy), shape (4, 4), MPa
    markers: Sample  # Points in the discs of the markers, without weights of their own
    means: torch.Tensor  # Weights that give the markers' displacements from those there, shape (m, k)
    observed: torch.Tensor  # Observed displacements, shape (m, 2), mm
    springs: torch.Tensor  # Square roots of the misfit's weights, shape (m, 2), MPa^1/2

    @classmethod
    def of(
        cls,
        problem: Problem,
        shape: ModifiedMlp,
        misfit: Misfit | None,
        *,
        base_length: float,
        dtype: torch.dtype = torch.float32,
    ) -> Self:
        """For a problem with a linear law, by the rule of degree 2 in each element.

        Args:
            problem: The problem.
            shape: Of the networks.
            misfit: Of the markers; None for none.
            base_length: Length of the factor of the base, mm.
            dtype: Of the arithmetic.
        """
        frame = NetworkFrame.of(problem.mesh, base_length)
        rule = body_quadrature(problem.mesh)
        contact, functional = contact_functional(problem)
        if misfit is None:
            nothing = np.zeros((0, 2))
            misfit = Misfit(nothing, nothing, nothing)
        points, means = misfit.sampling()

        def sample(points: FloatArray, weights: FloatArray) -> Sample:
            return frame.sample(torch.tensor(points), torch.tensor(weights), dtype)

        return cls(
            shape,
            frame,
            sample(rule.location.points, rule.weights),
            sample(contact, functional),
            torch.tensor([np.nan if u is None else u for u in problem.load.displacement], dtype=dtype),
            stiffness_matrix(problem.material.lame),
            sample(points, np.ones(len(points))),
            torch.tensor(means, dtype=dtype),
            torch.tensor(misfit.observed, dtype=dtype),
            torch.tensor(np.sqrt(misfit.weights), dtype=dtype),
        )

    def with_type(self, dtype: torch.dtype) -> Self:
        """The same in another precision."""

        def cast(sample: Sample) -> Sample:
            return Sample(*(part.to(dtype) for part in (sample.inputs, sample.factor, sample.weights)))

        return replace(
            self,
            body=cast(self.body),
            contact=cast(self.contact),
            prescribed=self.prescribed.to(dtype),
            markers=cast(self.markers),
            means=self.means.to(dtype),
            observed=self.observed.to(dtype),
            springs=self.springs.to(dtype),
        )

    @property
    def roots(self) -> torch.Tensor:
        """R, shape (3, 4)."""
        values, vectors = np.linalg.eigh(self.stiffness)
        return torch.tensor(np.sqrt(values[1:, None]) * vectors.T[1:], dtype=self.body.weights.dtype)

    def shift(self, parameters: torch.Tensor) -> torch.Tensor:
        """The constants s, shape (2,); zero for a component that is free."""
        functional = self.contact.weights * self.contact.factor[:, 0]
        mean = Streams.of(self.shape, parameters, self.contact.inputs).output[:, 0] @ functional
        return torch.nan_to_num((self.prescribed - mean) / functional.sum())

    def shift_slopes(self, parameters: torch.Tensor) -> torch.Tensor:
        """Derivatives of each constant by the parameters of its own network, shape (2, parameters)."""
        leaf = parameters.detach().requires_grad_()
        return torch.autograd.grad(self.shift(leaf).sum(), leaf)[0]

    def value(self, parameters: torch.Tensor) -> float:
        """Energy and misfit per depth, N mm/mm."""
        shift = self.shift(parameters)
        pieces = map_in_threads(
            lambda rows: float(self._energy(parameters, shift, self.body[rows])),
            slices(len(self.body), PIECE),
        )
        return sum(pieces) + float(self._misfit(parameters, shift))

    def misfit(self, parameters: torch.Tensor) -> float:
        """The misfit alone, N mm/mm."""
        return float(self._misfit(parameters, self.shift(parameters)))

    def value_and_gradient(self, parameters: torch.Tensor) -> tuple[float, torch.Tensor]:
        """The same, and its derivatives by the parameters, of their shape."""
        trained = parameters.detach().requires_grad_()
        shift = self.shift(trained)

        def differentiated(
            value: torch.Tensor, leaf: torch.Tensor
        ) -> tuple[float, torch.Tensor, torch.Tensor]:
            of_trained, of_leaf = torch.autograd.grad(value, (trained, leaf))
            return float(value.detach()), of_trained, of_leaf

        def piece(rows: slice) -> tuple[float, torch.Tensor, torch.Tensor]:
            leaf = shift.detach().requires_grad_()
            return differentiated(self._energy(trained, leaf, self.body[rows]), leaf)

        parts = map_in_threads(piece, slices(len(self.body), PIECE))
        if len(self.means):
            leaf = shift.detach().requires_grad_()
            parts.append(differentiated(self._misfit(trained, leaf), leaf))
        values, gradients, of_shift = zip(*parts, strict=True)
        through = torch.autograd.grad(shift, trained, torch.stack(of_shift).sum(dim=0))[0]
        return sum(values), torch.stack(gradients).sum(dim=0) + through

    def jacobian(
        self, parameters: torch.Tensor, slopes: torch.Tensor, sample: Sample, chosen: torch.Tensor
    ) -> torch.Tensor:
        """Derivatives of du_i/dx and du_i/dy by chosen parameters of network i, times the roots of weights.

        Args:
            parameters: Shape (2, parameters).
            slopes: See `shift_slopes`.
            sample: n points of the body.
            chosen: Numbers of parameters of each network, ascending, shape (2, c).

        Returns:
            Shape (2, 2, n, c): networks, directions, points, parameters.
        """
        factors = sample.gradient_factors
        result = Streams.of(self.shape, parameters, sample.inputs).jacobian(factors, chosen)
        for network in range(2):
            result[network] += factors[:, :, :1] * slopes[network, chosen[network]]
        return result.mul_(sample.weights.sqrt()[:, None])

    def marker_jacobian(
        self, parameters: torch.Tensor, slopes: torch.Tensor, chosen: torch.Tensor
    ) -> torch.Tensor:
        """Derivatives of the markers' residuals by chosen parameters of their network, shape (2, m, c)."""
        factors = self.markers.factor.new_zeros(1, len(self.markers), 3)
        factors[0, :, 0] = self.markers.factor[:, 0]
        values = Streams.of(self.shape, parameters, self.markers.inputs).jacobian(factors, chosen)[:, 0]
        for network in range(2):
            values[network] += factors[0, :, :1] * slopes[network, chosen[network]]
        return self.springs.T[:, :, None] * (self.means @ values)

    def residuals(self, parameters: torch.Tensor, sample: Sample) -> torch.Tensor:
        """Three at each point of a sample, then those of the markers in u and in v, shape (3 n + 2 m,)."""
        shift = self.shift(parameters)
        body = self.roots @ self._gradients(parameters, shift, sample) * sample.weights.sqrt()
        return torch.cat([body.flatten(), self._marker_residuals(parameters, shift).T.flatten()])

    def mixing(self, points: int) -> tuple[csr_matrix, csr_matrix]:
        """For each network, the matrix from its rows to the residuals of a sample.

        Rows are those of `jacobian` at n points, and of `marker_jacobian`: shape (3 n + 2 m, 2 n + m).
        """
        count, roots = len(self.means), self.roots.numpy()
        found = []
        for network in range(2):
            body = bmat(
                [
                    [diags(np.full(points, entry)) for entry in row[2 * network : 2 * network + 2]]
                    for row in roots
                ]
            )
            marker = np.zeros((2 * count, count))
            marker[network * count : (network + 1) * count] = np.eye(count)
            found.append(
                bmat([[body, None], [None, csr_matrix(marker)]] if count else [[body]], format="csr")
            )
        return found[0], found[1]

    def normal_matrix(self, parameters: torch.Tensor, sample: Sample, chosen: torch.Tensor) -> torch.Tensor:
        """Gauss-Newton's matrix J^T J of the chosen parameters of both networks, double precision.

        Args:
            parameters: Shape (2, parameters).
            sample: Points of the body with weights of a quadrature rule.
            chosen: Numbers of parameters of each network, ascending, shape (2, c).

        Returns:
            Shape (2 c, 2 c), the parameters of u first.
        """
        slopes, count, stiffness = self.shift_slopes(parameters), chosen.shape[1], self.stiffness

        def piece(rows: slice) -> torch.Tensor:
            (u_x, u_y), (v_x, v_y) = self.jacobian(parameters, slopes, sample[rows], chosen)
            part: torch.Tensor = u_x.new_empty(2, 2, count, count)
            part[0, 0] = stiffness[0, 0] * (u_x.T @ u_x) + stiffness[1, 1] * (u_y.T @ u_y)
            part[1, 1] = stiffness[2, 2] * (v_x.T @ v_x) + stiffness[3, 3] * (v_y.T @ v_y)
            part[0, 1] = stiffness[0, 3] * (u_x.T @ v_y) + stiffness[1, 2] * (u_y.T @ v_x)
            return part

        total = torch.zeros(2, 2, count, count, dtype=torch.float64)
        for part in map_in_threads(piece, slices(len(sample), 2 * PIECE)):
            total += part
        if len(self.means):
            of_markers = self.marker_jacobian(parameters, slopes, chosen).double()
            for network in range(2):
                total[network, network] += of_markers[network].T @ of_markers[network]
        total[1, 0] = total[0, 1].T
        return total.permute(0, 2, 1, 3).reshape(2 * count, 2 * count)

    def _gradients(self, parameters: torch.Tensor, shift: torch.Tensor, sample: Sample) -> torch.Tensor:
        """du/dx, du/dy, dv/dx and dv/dy, shape (4, n)."""
        output = Streams.of(self.shape, parameters, sample.inputs).output
        return sample.displacement(output, shift)[:, 1:].flatten(0, 1)

    def _energy(self, parameters: torch.Tensor, shift: torch.Tensor, sample: Sample) -> torch.Tensor:
        residuals = self.roots @ self._gradients(parameters, shift, sample)
        return 0.5 * (sample.weights * residuals.square().sum(dim=0)).sum()

    def _misfit(self, parameters: torch.Tensor, shift: torch.Tensor) -> torch.Tensor:
        return 0.5 * self._marker_residuals(parameters, shift).square().sum()

    def _marker_residuals(self, parameters: torch.Tensor, shift: torch.Tensor) -> torch.Tensor:
        """Shape (m, 2)."""
        output = Streams.of(self.shape, parameters, self.markers.inputs).output
        values = self.means @ self.markers.displacement(output, shift)[:, 0].T
        residuals: torch.Tensor = self.springs * (values - self.observed)
        return residuals
