"""`fem-asm`: the displacement of least energy plus misfit to the markers, exactly, on the shared mesh.

At a stationary point of E(u) + 1/2 (B u - d)^T W (B u - d) the force f_j acts on component j of the markers,
where b_j . u + f_j / W_jj = d_j: the misfit is a compliant spring.
For the linear law the forces follow from the compliance at the markers. At finite strain the observed
displacements grow with the load on its path; to leave a marker out, Newton's method continues from the
solution without its two springs and, where that does not converge, from rest.
"""

import time
from dataclasses import dataclass, replace

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.assimilation.marker_forces import MarkerForces, residual_phrase
from pinnray.solvers.assimilation.misfit import MarkerSettings, Misfit, leave_one_out_displacements
from pinnray.solvers.assimilation.picture_frames import FreePictures
from pinnray.solvers.constrained_elimination import ConstrainedElimination
from pinnray.solvers.fem.boundary_conditions import DisplacementConstraints, reaction_by_residual_work
from pinnray.solvers.fem.equilibrium import DiscreteEquilibrium
from pinnray.solvers.fem.finite_strain.load_path import LoadPath
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.lagrange import LagrangeField, LagrangeSpace
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import Solution, Status
from pinnray.solvers.solver import Cost, ElementSettings, Progress, check_problem, silent


@dataclass(frozen=True, eq=False)
class MarkerCompliance:
    """Finite-element displacements, free and under forces at m markers."""

    equilibrium: DiscreteEquilibrium  # The factorised problem; its factors are to be destroyed after use
    undisturbed: FloatArray  # Nodal displacements without forces at the markers, shape (N, 2), mm
    # The 2 m displacements of the markers as functionals, and the nodal displacements under their unit
    # forces, while base and load hold at zero
    markers: ConstrainedElimination

    def forces(self, misfit: Misfit) -> MarkerForces:
        """The minimisers of energy plus misfit, in terms of the forces at the markers."""
        compliance = self.markers.flexibility
        missed = misfit.observed - self.markers.values(self.undisturbed).reshape(-1, 2)
        return MarkerForces(0.5 * (compliance + compliance.T), misfit.weights, missed)

    def under(self, forces: FloatArray) -> FloatArray:
        """Nodal displacements under forces at the markers, shape (m, 2), N/mm: shape (N, 2), mm."""
        return self.undisturbed + np.tensordot(forces.ravel(), self.markers.responses, axes=1)


@dataclass(frozen=True)
class FemAsmSolver(MarkerSettings, ElementSettings):
    """`fem` with the markers' misfit: one factorisation, and one solve for each component of a marker.

    For a law of finite strain it is `fem-nonlinear` with the misfit, solved again without each marker.
    """

    name = "fem-asm"
    family = "finite elements"
    laws = FemSolver.laws + FemNonlinearSolver.laws
    loads = FemSolver.loads
    cost = Cost(per_triangle=55)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.check_weights()

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Solve for the minimiser; see `Solver`. Without markers it is `fem` or `fem-nonlinear`."""
        check_problem(self, problem)
        linear = problem.material.law in FemSolver.laws
        if (misfit := self.misfit(problem)) is not None:
            return (self._minimiser if linear else self._stationary)(problem, misfit, progress)
        if linear:
            plain = FemSolver(degree=self.degree, estimate=False).solve(problem, progress)
        else:
            plain = FemNonlinearSolver(degree=self.degree).solve(problem, progress)
        said = f"without markers, or with weights of zero, this is {plain.solver}: {plain.status.message}"
        return replace(plain, solver=self.name, status=Status(plain.status.converged, said))

    def _minimiser(self, problem: Problem, misfit: Misfit, progress: Progress) -> Solution:
        """For the linear law: the minimiser over displacement and unknown frames of the pictures."""
        started, observations = time.perf_counter(), problem.observations
        space = LagrangeSpace(problem.mesh, self.degree)
        equilibrium = DiscreteEquilibrium(problem, space)
        rows = DisplacementConstraints.springs(misfit, space).functionals
        markers = ConstrainedElimination(rows, equilibrium.responses(rows))
        finger = MarkerCompliance(equilibrium, equilibrium.linear_guess(1.0).nodal, markers)
        progress(0.9, "solved for the forces at the markers")
        if observations is None or not (pictures := FreePictures.of(observations)).parameters:
            solution = self._fitted(problem, misfit, finger)
        else:
            found = pictures.by_forces(finger.forces(misfit), self)
            seen = pictures.straightened(observations, found.z)
            straight = replace(misfit, observed=seen.displacements[seen.visible])
            solution = self._fitted(replace(problem, observations=seen), straight, finger)
            solution = pictures.framed(solution, problem, found)
        equilibrium.factors.destroy()
        return replace(solution, stats={**solution.stats, "seconds": time.perf_counter() - started})

    def _fitted(self, problem: Problem, misfit: Misfit, finger: MarkerCompliance) -> Solution:
        forces = finger.forces(misfit)
        factor = self.factor(forces)
        fit = forces.fit(factor)
        nodal, space = finger.under(fit.forces), LagrangeSpace(problem.mesh, self.degree)
        residual = finger.equilibrium.internal_force(nodal)
        return Solution(
            solver=self.name,
            problem=problem,
            field=LagrangeField(space, nodal),
            energy=0.5 * float((nodal * residual).sum()),
            reaction=reaction_by_residual_work(space, residual) - fit.forces.sum(axis=0),
            status=Status(True, f"the minimiser on this mesh; {fit.phrase}"),
            stats={
                "unknowns": nodal.size,
                "triangles": len(problem.mesh.triangles),
                "degree": self.degree,
                "weight_factor": factor,
                "misfit": factor * misfit.value(misfit.observed - fit.residual),
                "marker_force": float(np.linalg.norm(fit.forces, axis=1).max()),
            },
            history=self.curve(forces),
            left_out=leave_one_out_displacements(problem, fit.residual_without),
        )

    def _stationary(self, problem: Problem, misfit: Misfit, progress: Progress) -> Solution:
        """At finite strain: the stationary point that the load path leads to, also without each marker."""
        started = time.perf_counter()
        space = LagrangeSpace(problem.mesh, self.degree)
        # Shorter steps do not help: large forces at the markers invert elements.
        solver = FemNonlinearSolver(degree=self.degree, min_step=0.01)
        springs = DisplacementConstraints.springs(misfit, space)
        constraints = DisplacementConstraints.of(problem, space).joined(springs)
        path = solver.path(problem, space, constraints)
        path.follow(lambda done, text: progress(0.5 * done, text))
        stats, phrase, history, last = path.stats, path.phrase, path.history(), path.points[-1]
        forces = last.forces[-len(springs.targets) :].reshape(-1, 2)
        reaction = path.reaction(last) - forces.sum(axis=0)
        residual = (springs.targets - springs.values(last.nodal)).reshape(-1, 2)
        if last.fraction < 1:
            left_out = None
            advice = "let the contact slide, or take smaller weights"
            status = Status(False, f"{phrase}: load and markers contradict each other; {advice}")
        else:
            missed = _left_out(path, solver, springs, progress)
            found, lost = missed[np.isfinite(missed)], int(np.isnan(missed[:, 0]).sum())
            said = f"energy plus misfit is stationary: {phrase}; {residual_phrase(residual, found)}"
            if lost:
                said += f"; no equilibrium was found without {lost} of the markers"
            left_out, status = leave_one_out_displacements(problem, missed), Status(True, said)
        path.close()
        return Solution(
            solver=self.name,
            problem=problem,
            field=LagrangeField(space, last.nodal),
            energy=float(history["energy"][-1]),
            reaction=reaction,
            status=status,
            stats={
                "seconds": time.perf_counter() - started,
                "unknowns": last.nodal.size,
                "triangles": len(problem.mesh.triangles),
                "degree": self.degree,
                **stats,
                "weight_factor": 1.0,
                "misfit": misfit.value(misfit.observed - residual),
                "marker_force": float(np.linalg.norm(forces, axis=1).max()),
            },
            history={name: history[name] for name in ("load_fraction", "energy")},
            left_out=left_out,
        )


def _left_out(
    path: LoadPath, solver: FemNonlinearSolver, springs: DisplacementConstraints, progress: Progress
) -> FloatArray:
    """Residual of each marker without it, shape (m, 2), mm; NaN where no equilibrium is found."""
    problem, constraints = path.equilibrium.problem, path.equilibrium.constraints
    count = len(springs.targets) // 2
    first = len(constraints.targets) - 2 * count
    missed = np.full((count, 2), np.nan)
    for marker in range(count):
        progress(0.5 + 0.5 * marker / count, f"without marker {marker}")
        own = slice(2 * marker, 2 * marker + 2)
        kept = np.ones(first + 2 * count, dtype=bool)
        kept[first:][own] = False
        if (point := path.relaxed(kept)) is None:
            again = solver.path(problem, LagrangeSpace(problem.mesh, solver.degree), constraints.only(kept))
            again.follow(silent)
            again.close()
            point = again.points[-1]
        if point.fraction == 1:
            missed[marker] = (springs.targets - springs.values(point.nodal))[own]
    return missed
