"""A finished comparison: one finger, one mesh, many solvers, one set of marker displacements."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.evaluation.metrics import solver_scores, truth_scores
from pinnray.comparison.evaluation.scores import Measurements, Scores
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.observations import Observations
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.fem.adaptive_refinement import Adaptation
from pinnray.solvers.problem import Load, Material
from pinnray.solvers.solver import Solver, UnsupportedProblemError, check_load, with_law

if TYPE_CHECKING:
    import pandas as pd


TRUTH = "truth"
"""Name of the field of the virtual experiment."""


@dataclass(frozen=True, eq=False)
class Results:
    """The results of several solvers for one finger under one load; `comparison["fem"]` is one of them."""

    design: Finger
    mesh: TriangleMesh  #: The mesh that the solvers shared.
    observations: Observations  #: Marker displacements, measured or simulated.
    evaluations: Sequence[Evaluation]  #: One for each solver, in the order of tables and pictures.
    reference: Evaluation  #: The evaluation that the others are compared with.
    material: Material = field(default_factory=Material)  #: Elastic constants; each evaluation has its law.
    load: Load = field(default_factory=Load)
    truth: Evaluation | None = None  #: Fields of the virtual experiment; None where markers were measured.
    adaptation: Adaptation | None = None  #: Rounds of mesh refinement, if a tolerance was given.
    settings: Mapping[str, Mapping[str, object]] = field(default_factory=dict)  #: Of each solver, by name.
    unsupported: Mapping[str, str] = field(default_factory=dict)  #: Reasons, by the solvers' names.
    failed: Mapping[str, str] = field(default_factory=dict)  #: Reasons of those that failed, by their names.
    tracebacks: Mapping[str, str] = field(default_factory=dict)  #: Of those that raised, by their names.
    warnings: Sequence[str] = ()  #: Remarks of the marker tracking and on unlikely measurements.

    @cached_property
    def scores(self) -> Scores:
        """Every number of the run, computed once."""
        given = self.observations
        return Scores(
            schema=2,
            design=self.design.definition(),
            material=self.material.model_dump(),
            load=self.load.model_dump(),
            measurements=Measurements(
                source=given.label, description=given.source, markers=int(given.visible.sum())
            ),
            warnings=tuple(self.warnings),
            left_out=self.unsupported,
            failed=self.failed,
            reference=self.reference.solver,
            truth=truth_scores(self.truth, self.load),
            solvers={
                each.solver: solver_scores(each, given, self.reference, self.truth, self.load)
                for each in self.evaluations
            },
        )

    def __repr__(self) -> str:
        solvers, seen = ", ".join(each.solver for each in self.evaluations), self.observations
        markers = f"{seen.visible.sum()} of {len(seen.visible)} markers {seen.label}"
        return f"{type(self).__name__}(finger {self.design.name!r}, {solvers}; {markers})"

    def __getitem__(self, solver: str) -> Evaluation:
        named = {evaluation.solver: evaluation for evaluation in self.evaluations}
        if solver in self.failed:
            raise UserError(self.failed[solver])
        if solver not in named:
            raise UserError(f"no solver of this comparison is called {solver!r}; it has {', '.join(named)}")
        return named[solver]

    @property
    def shown_fields(self) -> list[Evaluation]:
        """The evaluations whose fields are drawn and written: all, and the truth's under the name `truth`."""
        true = [] if self.truth is None else [replace(self.truth, solver=TRUTH)]
        return [*self.evaluations, *true]

    def observed(self, evaluation: Evaluation) -> FloatArray:
        """Places where markers were seen, shape (k, 2), mm, in the finger's frame as a solver found it."""
        given = self.observations
        off = evaluation.shown_displacement - evaluation.marker_displacement
        return np.asarray((given.points + given.displacements - off)[given.visible])

    @property
    def remarks(self) -> list[str]:
        """Solvers that were left out, with the reason, and the warnings."""
        return [*unsupported_remarks(self.unsupported), *self.warnings]

    @property
    def unconverged(self) -> list[Evaluation]:
        """Results that do not count as converged."""
        return [evaluation for evaluation in self.evaluations if not evaluation.converged]

    @property
    def unfinished(self) -> list[str]:
        """A sentence on each solver that failed or did not converge, and on a tolerance that was missed."""
        said = list(self.failed.values())
        for each in self.unconverged:
            why = "" if each.message in each.warnings else f": {each.message}"
            said.append(f"{each.solver} did not converge{why}")
        if self.adaptation is not None and not self.adaptation.reached:
            said.append(self.adaptation.message)
        return said

    def table(self) -> "pd.DataFrame":
        """The main numbers, a row a solver, as `summary.csv`; units are in the names of the columns.

        `in_sample` are errors at markers that the solver was given, `held_out` at markers that it was not;
        `to_reference` and `to_truth` are relative L2 distances over the body. NaN where there is no number.
        """
        import pandas as pd

        return pd.DataFrame(self.scores.rows()).set_index("solver")

    def figures(self) -> "pd.DataFrame":
        """What the finger does by each solver: force in N, tip, wrap, stress, compliance, mass.

        A row a solver, a column for each of `solvers.finger_figures.QUANTITIES`, with its unit in the name.
        Those from a solver that knows its interval have `_low` and `_high` columns of 95 %; NaN elsewhere.
        """
        import pandas as pd

        rows = {each.solver: each.figures.columns() for each in self.evaluations if each.figures is not None}
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("solver")


def pick_reference(evaluations: Sequence[Evaluation], wanted: str | None = None) -> Evaluation:
    """The evaluation called `wanted`, else `fem`, else the first."""
    named = {evaluation.solver: evaluation for evaluation in evaluations}
    return named.get(wanted or "fem", evaluations[0])


def supported_solvers(
    solvers: Sequence[Solver], spare: Collection[str], material: Material, load: Load
) -> tuple[list[Solver], dict[str, str]]:
    """The solvers that take a material and a load, and by name why others are left out.

    Raises:
        UnsupportedProblemError: If one does not that is not among the spare ones, or none does.
    """
    chosen: list[Solver] = []
    unsupported: dict[str, str] = {}
    for solver in solvers:
        try:
            check_load(solver, load)
            with_law(material, solver)
            chosen.append(solver)
        except UnsupportedProblemError as error:
            unsupported[solver.name] = (
                f"no load {load.kind!r}" if load.kind not in solver.loads else str(error)
            )
            if solver.name not in spare or len(unsupported) == len(solvers):
                raise
    return chosen, unsupported


def unsupported_remarks(unsupported: Mapping[str, str]) -> list[str]:
    """A line a reason, with the solvers that it holds for."""
    reasons: dict[str, list[str]] = {}
    for name, reason in unsupported.items():
        reasons.setdefault(reason, []).append(name)
    return [f"left out: {', '.join(names)} ({reason})" for reason, names in reasons.items()]
