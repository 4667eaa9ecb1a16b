"""Cross-validation: solvers scored at markers, loads and fields that they were not given."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from compare.crossval.folds import LOAD, FoldResult, LoadCase, SeedResults, folds_of, load_cases_of
from compare.crossval.output_files import write_results
from compare.crossval.result import CrossvalResult, LayoutResult
from compare.crossval.solver_folds import SolverTask, run_folds
from compare.crossval.study import MEASURED, Study, visible_markers
from compare.crossval.true_fields import SampledField, TruthTask, simulate_truth
from compare.crossval.weight_sweep import SWEPT, sweep_weights
from compare.evaluation.shared_mesh import check_inside
from compare.evaluation.virtual_experiment import experiment_source
from compare.runtime.output_folder import locked
from compare.runtime.processes import ProcessFailed, in_stages
from compare.runtime.resumable_folder import check_resumable_folder
from compare.runtime.stages import Stages
from geometry.arrays import FloatArray
from geometry.atomic import write_json
from geometry.cache import finger_mesh
from geometry.errors import UserError
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
        truths = {} if measured else _truths(study, load_cases, stages)
        if measured:
            observations = {MEASURED: [[measured]] * study.seeds}
        else:
            observations = _noisy(study, truths, experiment_source(problem))
        folds = {
            layout: folds_of(study.schemes, len(seeds[0][0].points), load_cases)
            for layout, seeds in observations.items()
        }
        tasks = {
            (layout, variant.label): SolverTask(
                study,
                layout,
                variant,
                load_cases,
                truths.get(layout, []),
                observations[layout],
                folds[layout],
            )
            for layout in observations
            for variant in study.variants
        }
        results, failed = _results(study, tasks, stages)
        sweeps = _sweeps(tasks, results, stages) if truths else {}
        found = CrossvalResult(
            study,
            {
                layout: LayoutResult.of(seeds[0][0], folds[layout], results[layout], failed[layout])
                for layout, seeds in observations.items()
            },
        )
        provenance = {**definition, "problem_sha256": problem.digest, **stages.record()}
        with stages.stage("report"):
            write_results(study.out, found, results, sweeps, provenance)
    return found


def _truths(study: Study, load_cases: Sequence[LoadCase], stages: Stages) -> dict[str, list[Path]]:
    """Files of the true fields of every layout at every load; each load is simulated in its own process."""
    tasks = {f"truth, {case.name}": TruthTask(study, case) for case in load_cases}
    found: dict[str, dict[str, Path]] = {}
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
    return {layout: [found[name][layout] for name in tasks] for layout in study.markers}


def _noisy(
    study: Study, truths: Mapping[str, Sequence[Path]], source: str
) -> dict[str, list[list[Observations]]]:
    """For each layout the true marker displacements with noise, for each seed at each load."""

    def observed(points: FloatArray, true: FloatArray, seed: int, at: int) -> Observations:
        return Observations(
            points=points,
            displacements=true + np.random.default_rng([seed, at]).normal(0, study.noise, true.shape),
            standard_deviations=np.full_like(true, study.noise),
            visible=np.ones(len(true), dtype=bool),
            source=f"{source}, with {study.noise:g} mm of noise",
            simulated=True,
            marker_radius=study.design.marker_radius,
        )

    found = {}
    for layout, points in study.markers.items():
        displacements = [SampledField.load(path).markers for path in truths[layout]]
        found[layout] = [
            [observed(points, true, seed, at) for at, true in enumerate(displacements)]
            for seed in range(study.seeds)
        ]
    return found


def _results(
    study: Study, tasks: Mapping[tuple[str, str], SolverTask], stages: Stages
) -> tuple[dict[str, dict[str, SeedResults]], dict[str, dict[str, str]]]:
    """By layout the results of every solver, and the error messages of the solvers that failed."""

    def note(_: str, answer: list[list[FoldResult]] | str | ProcessFailed) -> str:
        if isinstance(answer, ProcessFailed):
            return answer.message
        return answer if isinstance(answer, str) else "scored"

    layouts = list(dict.fromkeys(layout for layout, _ in tasks))
    named = {label if len(layouts) == 1 else f"{label}, {layout}": (layout, label) for layout, label in tasks}
    answers = dict(
        in_stages(
            run_folds,
            {name: tasks[key] for name, key in named.items()},
            processes=study.processes,
            stages=stages,
            kind="solvers",
            note=note,
        )
    )
    results: dict[str, dict[str, SeedResults]] = {layout: {} for layout in layouts}
    failed: dict[str, dict[str, str]] = {layout: {} for layout in layouts}
    for name, (layout, label) in named.items():
        answer = answers[name]
        if isinstance(answer, list):
            results[layout][label] = answer
        else:
            failed[layout][label] = note(name, answer)
    if not all(results.values()):
        messages = {name: note(name, answers[name]) for name, (layout, _) in named.items() if failed[layout]}
        raise UserError("; ".join(f"{name}: {message}" for name, message in messages.items()))
    return results, failed


def _sweeps(
    tasks: Mapping[tuple[str, str], SolverTask],
    results: Mapping[str, Mapping[str, SeedResults]],
    stages: Stages,
) -> dict[str, dict[str, list[float]]]:
    """The sweep of `sweep_weights` for each layout, if its solver is there."""
    swept = {layout: tasks[layout, SWEPT] for layout, each in results.items() if SWEPT in each}
    answers = dict(
        in_stages(sweep_weights, swept, processes=1, stages=stages, kind="curves", note=lambda *_: "weighed")
    )
    return {layout: each for layout, each in answers.items() if not isinstance(each, ProcessFailed)}
