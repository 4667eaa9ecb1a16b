"""Certificates of solutions of the linear problem, from one factorisation of the finite-element stiffness."""

import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pinnray.comparison.evaluation.certificate import ROUNDING, Certificate
from pinnray.comparison.evaluation.evaluation import QUADRATURE_DEGREE, Evaluation
from pinnray.geometry.mesh.quadrature import body_quadrature
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.fem.boundary_conditions import reaction_by_residual_work
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.solvers.problem import Problem
from pinnray.solvers.registry import MissingLibraryError, make_solver

NOT_FINITE = "its displacement or stress is not finite everywhere"
"""Fault of a result with NaN or infinity in a field."""


def with_certificates(evaluations: Sequence[Evaluation], problem: Problem) -> list[Evaluation]:
    """Certify the evaluations of the linear law, sampled on the problem's mesh, and judge their convergence.

    The least energy settles the question for the linear law only, whose energy is quadratic. It does not
    judge a solver that was given observations, which pays energy for them, a body in three dimensions or at
    rest, nor a found contact. Without DOLFINx there are no certificates, and a
    warning says so.
    """

    def certifiable(evaluation: Evaluation) -> bool:
        return evaluation.law == "linear" and not evaluation.in_sample and not evaluation.solid

    if (
        problem.load.kind == "cylinder"
        or not problem.load.values.any()
        or not any(map(certifiable, evaluations))
    ):
        return list(evaluations)
    try:
        make_solver("fem")
    except MissingLibraryError as error:
        warnings.warn(f"no result is certified: {error}", stacklevel=2)
        return list(evaluations)
    certifier = Certifier(replace(problem, material=problem.material.model_copy(update={"law": "linear"})))
    return [
        with_certificate(evaluation, certifier.certificate(evaluation) if evaluation.finite else None)
        if certifiable(evaluation)
        else evaluation
        for evaluation in evaluations
    ]


def with_certificate(evaluation: Evaluation, certificate: Certificate | None) -> Evaluation:
    """Attach a certificate; the evaluation does not count as converged if the certificate finds a fault.

    A result that is not finite has no certificate, which is a fault of its own.
    """
    faults = [NOT_FINITE] if certificate is None else certificate.faults
    return replace(
        evaluation,
        converged=evaluation.converged and not faults,
        message="; ".join([evaluation.message.rstrip(". "), *faults]),
        certificate=certificate,
    )


class Certifier:
    """Finite elements of degree 2 on a problem's mesh, by which any displacement is measured."""

    def __init__(self, problem: Problem) -> None:
        from pinnray.solvers.fem.equilibrium import linear_equilibrium  # it needs DOLFINx

        self._problem = problem
        self._space = LagrangeSpace(problem.mesh, 2)
        self._equilibrium = linear_equilibrium(problem, 2)
        self._rule = body_quadrature(problem.mesh, QUADRATURE_DEGREE)
        self._derivatives = self._space.shape_gradients(self._rule.location)
        self._solution = self._equilibrium.linear_guess(1.0).nodal

    def certificate(self, evaluation: Evaluation) -> Certificate:
        """The certificate of an evaluation of the linear law on the problem's mesh.

        Raises:
            RuntimeError: If a displacement in the finite-element space has less energy than the least one.
        """
        nodal = np.concatenate([evaluation.node_displacement, evaluation.edge_displacement])
        values = self._equilibrium.constraints.values(nodal)
        least, _ = self._equilibrium.minimiser(nodal, values)
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
        reaction = reaction_by_residual_work(self._space, self._equilibrium.internal_force(self._solution))
        load = self._problem.load
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
            work=float(evaluation.reaction[load.prescribed] @ load.values),
            stroke=float(np.abs(load.values).max()),
        )

    def _energy(self, nodal: FloatArray) -> float:
        """Elastic energy of nodal displacements, N mm / mm."""
        return 0.5 * float((nodal * self._equilibrium.internal_force(nodal)).sum())

    def _imbalance(self, stress: FloatArray) -> tuple[FloatArray, float]:
        """Residual of the internal forces of a stress (q, 2, 2), MPa, balanced best by the reactions.

        Returns:
            Nodal forces, shape (N, 2), N/mm, zero where displacements are given; and their dual norm over
            the energy norm of the solution.
        """
        weighted = self._rule.weights[:, None, None] * stress
        forces = sum(derivative.T @ weighted[:, :, axis] for axis, derivative in enumerate(self._derivatives))
        equilibrium = self._equilibrium
        rest, reactions = equilibrium.elimination.solution(equilibrium.factors.solve(forces))
        unbalanced = forces + equilibrium.elimination.weighted(reactions)
        balance = np.where(equilibrium.clamped, 0.0, unbalanced)
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
