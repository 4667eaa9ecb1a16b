"""Certificates of solutions of the linear problem, from one factorisation of the finite-element stiffness."""

import numpy as np

from compare.evaluation.certificate import ROUNDING, Certificate, Region
from compare.evaluation.differences import field_difference
from compare.evaluation.evaluation import QUADRATURE_DEGREE, Evaluation
from compare.evaluation.regions import body_regions
from geometry.arrays import FloatArray
from geometry.mesh.quadrature import body_quadrature
from solvers.elasticity import energy_density_of
from solvers.fem.boundary_conditions import reaction_by_residual_work
from solvers.fem.linear_equilibrium import LinearElasticity, LinearEquilibrium
from solvers.lagrange import LagrangeField, LagrangeSpace
from solvers.problem import Problem
from solvers.solution import State


class Certifier:
    """Finite elements of degree 2 on a problem's mesh, by which any displacement is measured."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._space = LagrangeSpace(problem.mesh, 2)
        self._elasticity = LinearElasticity.of(problem, self._space)
        self._equilibrium = LinearEquilibrium.of(self._elasticity)
        self._rule = body_quadrature(problem.mesh, QUADRATURE_DEGREE)
        self._derivatives = self._space.shape_gradients(self._rule.location)
        self._solution = self._equilibrium.solution()
        field = LagrangeField(self._space, self._solution)
        self._displacement = field.displacement(self._rule.location)
        self._von_mises = State.from_gradient(self._gradient(self._solution), problem).von_mises
        self._regions = body_regions(problem)

    def certificate(self, evaluation: Evaluation) -> Certificate:
        """The certificate of an evaluation of the linear law on the problem's mesh.

        Raises:
            RuntimeError: If a displacement in the finite-element space has less energy than the least one.
        """
        nodal = np.concatenate([evaluation.node_displacement, evaluation.edge_displacement])
        values = self._equilibrium.load.values(nodal)
        least = self._equilibrium.minimiser(nodal, values)
        rest = nodal - least
        energy, least_energy, excess, violation, fem_energy = (
            self._energy(field) for field in (nodal, least, rest, least - self._solution, self._solution)
        )
        if energy - least_energy < -ROUNDING * (energy + fem_energy):
            raise RuntimeError(
                f"{evaluation.solver}: its interpolant has {energy:.10g} N mm/mm of energy, below the least, "
                f"{least_energy:.10g}: the stiffness or its factorisation is wrong"
            )
        balance, weak_residual = self._imbalance(evaluation.stress)
        reaction = reaction_by_residual_work(self._space, self._elasticity.internal_force(self._solution))
        density = energy_density_of("linear", self._gradient(rest), self._problem.material.lame)
        return Certificate(
            energy=energy,
            fem_energy=fem_energy,
            excess=excess,
            violation=violation,
            missed=least_energy - evaluation.energy,
            weak_residual=weak_residual,
            imbalance=float(np.linalg.norm(balance, axis=1).max() / np.linalg.norm(reaction)),
            base=float(np.linalg.norm(nodal[self._space.boundary_nodes("base")], axis=1).max()),
            load=self._load_missed(nodal, values),
            work=float(evaluation.reaction[self._problem.load.prescribed] @ self._problem.load.values),
            stroke=float(np.abs(self._problem.load.values).max()),
            regions=self._by_region(evaluation, density),
            density=evaluation.per_triangle(density),
        )

    def _energy(self, nodal: FloatArray) -> float:
        """Elastic energy of nodal displacements, N mm / mm."""
        return 0.5 * float((nodal * self._elasticity.internal_force(nodal)).sum())

    def _gradient(self, nodal: FloatArray) -> FloatArray:
        """Displacement gradient at the quadrature points, shape (q, 2, 2)."""
        return np.stack([derivative @ nodal for derivative in self._derivatives], axis=-1)

    def _imbalance(self, stress: FloatArray) -> tuple[FloatArray, float]:
        """Residual of the internal forces of a stress, with the reactions that balance it best.

        Args:
            stress: At the quadrature points, shape (q, 2, 2), MPa.

        Returns:
            Nodal forces, shape (N, 2), N/mm, zero where displacements are given; and their dual norm over
            the energy norm of the solution.
        """
        weighted = self._rule.weights[:, None, None] * stress
        forces = sum(derivative.T @ weighted[:, :, axis] for axis, derivative in enumerate(self._derivatives))
        balance, rest = self._equilibrium.residual(forces)
        dual = float((balance * rest).sum())
        return balance, float(np.sqrt(dual / (2 * self._energy(self._solution))))

    def _load_missed(self, nodal: FloatArray, values: FloatArray) -> FloatArray:
        """Deviation of u and v from the prescribed load, shape (2,), mm; NaN for a free component."""
        load = self._problem.load
        if load.kind == "patch":
            contact = nodal[self._space.boundary_nodes("contact")][:, load.prescribed]
            values = np.abs(contact - load.values).max(axis=0) + load.values
        missed = np.full(2, np.nan)
        missed[load.prescribed] = np.abs(values - load.values)
        return missed

    def _by_region(self, evaluation: Evaluation, density: FloatArray) -> dict[str, Region]:
        weights = self._rule.weights
        energy = weights * density
        total = energy.sum()
        regions = {}
        for name, triangles in self._regions.items():
            here = np.repeat(triangles, len(weights) // len(triangles))
            share = energy[here].sum() / total if total > ROUNDING**2 * evaluation.energy else np.nan
            displacement, von_mises = (
                field_difference(np.where(here, own.T, fem.T).T, fem, weights).rel_l2
                for own, fem in (
                    (evaluation.displacement, self._displacement),
                    (evaluation.von_mises, self._von_mises),
                )
            )
            area = weights[here].sum() / weights.sum()
            regions[name] = Region(float(area), float(share), displacement, von_mises)
        return regions
