"""Cross-validation: solvers scored at markers, loads and fields that they were not given."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from compare.crossval.folds import LOAD, FoldResult, LoadCase, SeedResults, folds_of, load_cases_of
from compare.crossval.output_files import write_results
from compare.crossval.result import CrossvalResult
from compare.crossval.solver_folds import SolverTask, run_folds
from compare.crossval.study import Study, visible_markers
from compare.crossval.true_fields import SampledField, TruthTask, simulate_truth
from compare.crossval.weight_sweep import SWEPT, sweep_weights
from compare.evaluation.shared_mesh import check_inside
from compare.evaluation.virtual_experiment import experiment_source
from compare.runtime.output_folder import locked
from compare.runtime.processes import ProcessFailed, in_stages
from compare.runtime.resumable_folder import check_resumable_folder
from compare.runtime.stages import Stages
from geometry.atomic import write_json
from geometry.cache import finger_mesh
from geometry.errors import UserError
from geometry.mesh.triangle_mesh import TriangleMesh
from geometry.observations import Observations
from solvers.problem import Problem

DEFINITION = "definition.json"


def cross_validate(study: Study, stages: Stages | None = None) -> CrossvalResult:
    """Score the solvers of a study in every fold and write the study's output folder.

    Solvers run in processes of their own. A Python script that calls this must do so below
    `if __name__ == "__main__":`, because those processes import the script. Finished folds stay in the output
    folder: the same study again goes on where it was stopped.

    Args:
        study: The finger, the solvers and what to hold out.
        stages: Shows the progress; None shows nothing.

    Raises:
        UserError: If the study cannot be done, or the folder holds something else.
    """
    stages = stages or Stages(quiet=True)
    study.check()
    measured = study.measurements and visible_markers(study.measurements)
    definition = study.definition(measured)
    check_resumable_folder(study.out / DEFINITION, definition, job="cross-validation")
    with stages.stage("mesh"):
        mesh = finger_mesh(study.design, settings=study.mesh)
        if measured:
            check_inside(measured, mesh)
        problem = Problem(mesh, study.material, study.load)
    load_cases = load_cases_of(problem, others=LOAD in study.schemes and measured is None)
    study.out.mkdir(parents=True, exist_ok=True)
    with locked(study.out):
        write_json(study.out / DEFINITION, definition)
        mesh.save(study.mesh_file)
        truths = [] if measured else _truths(study, load_cases, stages)
        if measured:
            observations = [[measured]] * study.seeds
        else:
            observations = _noisy(study, mesh, truths, experiment_source(problem))
        folds = folds_of(study.schemes, len(observations[0][0].points), load_cases)
        tasks = {
            variant.label: SolverTask(study, variant, load_cases, truths, observations, folds)
            for variant in study.variants
        }
        results, failed = _results(study, tasks, stages)
        sweep = _sweep(tasks, results, stages) if truths else {}
        found = CrossvalResult.of(study, observations[0][0], folds, results, failed)
        provenance = {**definition, "problem_sha256": problem.digest, **stages.record()}
        with stages.stage("report"):
            write_results(study.out, found, results, sweep, provenance)
    return found


def _truths(study: Study, load_cases: Sequence[LoadCase], stages: Stages) -> list[Path]:
    """Files of the true fields at every load, each simulated in a process of its own."""
    tasks = {f"truth, {case.name}": TruthTask(study, case) for case in load_cases}
    found: dict[str, Path] = {}
    for name, answer in in_stages(
        simulate_truth,
        tasks,
        processes=study.processes,
        stages=stages,
        kind="truths",
        note=lambda _, answer: "failed" if isinstance(answer, ProcessFailed) else "known",
    ):
        if isinstance(answer, ProcessFailed):
            raise UserError(
                f"{name}: the virtual experiment did not come to its end; press less, or give --measurements"
            )
        found[name] = answer
    return [found[name] for name in tasks]


def _noisy(study: Study, mesh: TriangleMesh, truths: Sequence[Path], source: str) -> list[list[Observations]]:
    """The true marker displacements with noise, for each seed at each load."""
    displacements = [SampledField.load(path).markers for path in truths]
    return [
        [
            Observations(
                points=mesh.markers,
                displacements=true + np.random.default_rng([seed, at]).normal(0, study.noise, true.shape),
                standard_deviations=np.full_like(true, study.noise),
                visible=np.ones(len(true), dtype=bool),
                source=f"{source}, with {study.noise:g} mm of noise",
                simulated=True,
                marker_radius=study.design.marker_radius,
            )
            for at, true in enumerate(displacements)
        ]
        for seed in range(study.seeds)
    ]


def _results(
    study: Study, tasks: Mapping[str, SolverTask], stages: Stages
) -> tuple[dict[str, list[list[FoldResult]]], dict[str, str]]:
    """The results of every solver, and the error messages of the solvers that failed."""

    def note(_: str, answer: list[list[FoldResult]] | str | ProcessFailed) -> str:
        if isinstance(answer, ProcessFailed):
            return answer.message
        return answer if isinstance(answer, str) else "scored"

    results, failed = {}, {}
    for name, answer in in_stages(
        run_folds, tasks, processes=study.processes, stages=stages, kind="solvers", note=note
    ):
        if isinstance(answer, list):
            results[name] = answer
        else:
            failed[name] = note(name, answer)
    if not results:
        raise UserError("; ".join(f"{name}: {message}" for name, message in failed.items()))
    return {name: results[name] for name in tasks if name in results}, failed


def _sweep(
    tasks: Mapping[str, SolverTask], results: Mapping[str, SeedResults], stages: Stages
) -> dict[str, list[float]]:
    """The sweep of `sweep_weights`, if its solver is there."""
    swept = {"weights": tasks[SWEPT]} if SWEPT in results else {}
    answers = dict(
        in_stages(sweep_weights, swept, processes=1, stages=stages, kind="curves", note=lambda *_: "weighed")
    )
    columns = answers.get("weights", {})
    return {} if isinstance(columns, ProcessFailed) else columns
