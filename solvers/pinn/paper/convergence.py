"""What a gradient-trained network amounts to: energy, reaction, and whether the training has settled."""

from typing import NamedTuple

import numpy as np

from geometry.arrays import FloatArray
from geometry.mesh.quadrature import body_quadrature
from solvers.elasticity import linear_energy_density
from solvers.pinn.paper.training import Training
from solvers.problem import Problem, contact_functional
from solvers.section_force import section_force
from solvers.solution import DisplacementField, Status

ENERGY_CHANGE = 0.01
"""Relative change of the energy over the last tenth of the epochs below which it has settled."""

VIOLATION = 0.01
"""Share of the stroke by which base and contact may miss their prescribed displacement."""


class Verdict(NamedTuple):
    """Energy per depth, N mm/mm; the indenter's force per depth, shape (2,), N/mm; how the training ended."""

    energy: float
    reaction: FloatArray
    status: Status


def judge(problem: Problem, field: DisplacementField, training: Training) -> Verdict:
    """Energy and reaction by the element rule, and the status by two criteria."""
    rule = body_quadrature(problem.mesh)
    gradient = field.gradient(rule.location)
    energy = float((rule.weights * linear_energy_density(gradient, problem.material.lame)).sum())
    reaction = section_force(problem, rule, gradient)
    change = _late_change(training.history[:, training.columns.index("energy")])
    base, contact = _violations(problem, field)
    converged = change <= ENERGY_CHANGE and max(base, contact) <= VIOLATION
    message = (
        f"{training.epoch} epochs; over their last tenth the energy changed by {change:.2%} (criterion "
        f"{ENERGY_CHANGE:.0%}), the base moves by {base:.2%} and the contact misses its displacement by "
        f"{contact:.2%} of the stroke (criterion {VIOLATION:.0%}); "
    )
    message += (
        "so the training has settled, which does not say how far it is from the least energy"
        if converged
        else "so the training has not settled: take more epochs"
    )
    return Verdict(energy, reaction, Status(converged, message))


def _late_change(energy: FloatArray) -> float:
    """Relative change from the last but one to the last twentieth, of their means: training is noisy."""
    count = max(len(energy) // 20, 1)
    if len(energy) < 2 * count:
        return float("inf")
    before, after = energy[-2 * count :].reshape(2, count).mean(axis=1)
    return float(abs(after - before) / abs(after))


def _violations(problem: Problem, field: DisplacementField) -> tuple[float, float]:
    """Root mean square displacement of the base and error of the contact's, as shares of the stroke."""
    mesh, load = problem.mesh, problem.load
    nodes = np.unique(mesh.boundary("base"))
    base = field.displacement(mesh.locate(mesh.points[nodes]))
    points, weights = contact_functional(problem)
    contact = (weights @ field.displacement(mesh.locate(points)))[load.prescribed] - load.values
    stroke = np.abs(load.values).max() or 1.0
    return float(np.sqrt((base**2).sum(axis=1).mean()) / stroke), float(np.abs(contact).max() / stroke)
