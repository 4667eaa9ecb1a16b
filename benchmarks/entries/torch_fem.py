"""torch-fem: quadratic triangles of plane strain at small and finite strain."""

import time
from dataclasses import dataclass
from importlib.metadata import version

import numpy as np
import torch
from torchfem.materials import HyperelasticPlaneStrain, IsotropicElasticityPlaneStrain
from torchfem.planar import Planar

from pinnray.solvers.energy_and_force import energy_and_force
from pinnray.solvers.lagrange import LagrangeField, LagrangeSpace
from pinnray.solvers.problem import Problem, contact_functional
from pinnray.solvers.solution import Solution, Status
from pinnray.solvers.solver import Progress, UnsupportedProblemError, check_problem, silent


@dataclass(frozen=True)
class TorchFemEntry:
    """Its solver of single nodes' forces and displacements; a mean one by two influence functions.

    Attributes:
        steps: Equal load steps at finite strain.
    """

    steps: int = 10
    name = "torch-fem"
    family = "finite elements"
    laws = ("linear", "neo-hookean")
    loads = ("mean", "point", "patch")

    def settings(self) -> dict[str, object]:
        """All fields, and the version."""
        return {**vars(self), "torch-fem": version("torch-fem")}

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Solve the problem."""
        check_problem(self, problem)
        load, linear = problem.load, problem.material.law == "linear"
        if load.kind != "patch" and not linear:
            raise UnsupportedProblemError(f"{self.name} takes a mean displacement by the linear law only")
        started, space = time.perf_counter(), LagrangeSpace(problem.mesh, 2)
        precision = torch.get_default_dtype()
        torch.set_default_dtype(torch.float64)
        try:
            nodal = self._linear_mean(problem, space) if load.kind != "patch" else self._patch(problem, space)
        finally:
            torch.set_default_dtype(precision)
        field = LagrangeField(space, nodal)
        energy, reaction = energy_and_force(problem, field)
        stats = {"seconds": time.perf_counter() - started, "unknowns": nodal.size}
        return Solution(
            self.name, problem, field, energy, reaction, Status(True, "every step converged"), stats
        )

    def _patch(self, problem: Problem, space: LagrangeSpace) -> np.ndarray:
        """Nodal displacements where the nodes of the contact are moved."""
        model, contact = self._model(problem, space), space.boundary_nodes("contact")
        for axis in problem.load.prescribed:
            model.constraints[contact, axis] = True
            model.displacements[contact, axis] = problem.load.displacement[axis]
        if problem.material.law == "linear":
            return model.solve()[0].numpy()
        return model.solve(increments=torch.linspace(0, 1, self.steps + 1))[0].numpy()

    def _linear_mean(self, problem: Problem, space: LagrangeSpace) -> np.ndarray:
        """Nodal displacements under the forces for which the mean displacement is the prescribed one."""
        at_nodes, axes = space.mean_value(*contact_functional(problem)), problem.load.prescribed
        influence = []
        for axis in axes:
            model = self._model(problem, space)
            model.forces[:, axis] = torch.tensor(at_nodes)
            influence.append(model.solve()[0].numpy())
        means = np.array([[at_nodes @ moved[:, axis] for moved in influence] for axis in axes])
        return np.tensordot(np.linalg.solve(means, problem.load.values), influence, axes=1)

    def _model(self, problem: Problem, space: LagrangeSpace) -> Planar:
        """The body, clamped at its base."""
        material, lame = problem.material, problem.material.lame
        if material.law == "linear":
            law = IsotropicElasticityPlaneStrain(E=material.young, nu=material.poisson)
        else:
            law = HyperelasticPlaneStrain(neo_hookean, [lame.λ, lame.μ])
        model = Planar(torch.tensor(space.nodes), torch.tensor(space.cell_nodes), law)
        model.constraints[space.boundary_nodes("base")] = True
        return model


def neo_hookean(gradient: torch.Tensor, constants: torch.Tensor) -> torch.Tensor:
    """Its energy density at a deformation gradient, MPa."""
    log_j = torch.logdet(gradient)
    own = (gradient**2).sum() - 3
    return 0.5 * constants[1] * own - constants[1] * log_j + 0.5 * constants[0] * log_j**2
