"""Cross-validation: solvers scored at markers, loads and fields that they were not given."""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from pinnray.comparison.crossval.folds import LOAD, FoldResult, LoadCase, SeedResults, folds_of, load_cases_of
from pinnray.comparison.crossval.output_files import write_results
from pinnray.comparison.crossval.result import Case, CaseResult, CrossvalResult
from pinnray.comparison.crossval.solver_folds import SWEPT, SolverTask, run_folds, sweep_weights
from pinnray.comparison.crossval.study import CrossvalStudy, visible_markers
from pinnray.comparison.crossval.true_fields import TrueField, TruthTask, simulate_truth
from pinnray.comparison.evaluation.plausibility import check_positions, displacement_remarks, problem_remarks
from pinnray.comparison.evaluation.truths import experiment_source
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.observations import Observations
from pinnray.geometry.registration import FIXED
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.atomic import write_json
from pinnray.runtime.errors import UserError
from pinnray.runtime.output_folder import check_resumable_folder, locked
from pinnray.runtime.processes.child import ProcessFailed
from pinnray.runtime.stages import Stages, in_stages
from pinnray.solvers.fem.assimilating import FemAsmSolver
from pinnray.solvers.problem import Problem
from pinnray.solvers.solver import Progress

DEFINITION = "definition.json"

Answer = TypeVar("Answer")


def cross_validate(study: CrossvalStudy, stages: Stages | None = None) -> CrossvalResult:
    """Score the solvers of a study in every fold and write the study's output folder.

    Solvers run in processes of their own; one whose class those cannot import, such as a class of the calling
    script or notebook, runs in this process after them. Finished folds stay in the output folder: the same
    study again goes on where it was stopped.

    Args:
        study: The finger, the solvers and what to hold out.
        stages: Shows the progress; None shows nothing.

    Raises:
        UserError: If the study cannot be done, or the folder holds something else.
    """
    stages = stages or Stages(quiet=True)
    study.check()
    given = study.measurements and visible_markers(study.measurements)
    definition = study.definition(given)
    check_resumable_folder(study.out / DEFINITION, definition, job="cross-validation")
    with stages.stage("mesh"):
        mesh = finger_mesh(study.design, settings=study.mesh)
        if mesh.moduli is not None:
            raise UserError("crossval takes a body of one material, and parts of this one have their own")
        if given:
            check_positions(given, mesh)
        problem = Problem(mesh, study.material, study.load)
        remarks = displacement_remarks(given, problem) if given else []
        for remark in [*problem_remarks(problem), *remarks]:
            warnings.warn(remark, stacklevel=2)
    load_cases = load_cases_of(problem, others=LOAD in study.schemes and given is None)
    study.out.mkdir(parents=True, exist_ok=True)
    with locked(study.out):
        write_json(study.out / DEFINITION, definition)
        mesh.save(study.mesh_file)
        files: dict[Case, list[Path]] = {}
        if given:
            observations = {Case(given.label, given.label): [[given]] * study.seeds}
        else:
            files = _true_fields(study, load_cases, stages)
            observations = {case: _noisy(study, case, paths, problem) for case, paths in files.items()}
        folds = {
            case: folds_of(study.schemes, len(seeds[0][0].points), load_cases)
            for case, seeds in observations.items()
        }
        own = replace(study, variants=())  # other processes may not know the classes of all solvers
        tasks = {
            (case, variant.label): SolverTask(
                own,
                case.layout,
                variant,
                load_cases,
                files.get(case, []),
                observations[case],
                folds[case],
                study.chosen_truths.get(case.truth),
            )
            for case in observations
            for variant in study.variants
        }
        results, failed = _results(study, tasks, stages)
        sweeps = _sweeps(tasks, results, study.processes, stages) if files else {}
        found = CrossvalResult(
            study,
            {
                case: CaseResult.of(seeds[0][0], folds[case], results[case], failed[case])
                for case, seeds in observations.items()
            },
            {case.truth: TrueField.load(paths[0]).contact for case, paths in files.items()},
        )
        provenance = {**definition, "problem_sha256": problem.digest, **stages.record()}
        with stages.stage("report"):
            write_results(study.out, found, results, sweeps, provenance)
    for remark in found.remarks:
        warnings.warn(remark, stacklevel=2)
    return found


def _true_fields(
    study: CrossvalStudy, load_cases: Sequence[LoadCase], stages: Stages
) -> dict[Case, list[Path]]:
    """Files of the true fields at every load, each of which is simulated in its own process."""
    truths, own = study.chosen_truths, replace(study, variants=())
    tasks = {
        "truth, " + (f"{name}, " if len(truths) > 1 else "") + case.name: TruthTask(own, truth, case)
        for name, truth in truths.items()
        for case in load_cases
    }
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
                f"{name}: the virtual experiment did not come to its end; press less, drop the truth or "
                f"{LOAD}, or give measurements"
            )
        found[name] = answer
    return {
        Case(truth, layout): [found[name][layout] for name, task in tasks.items() if task.truth.name == truth]
        for truth in truths
        for layout in study.markers
    }


def _noisy(
    study: CrossvalStudy, case: Case, paths: Sequence[Path], problem: Problem
) -> list[list[Observations]]:
    """True marker displacements with noise, for each seed at each load; the noise is equal in every truth."""
    source = experiment_source(problem, study.chosen_truths[case.truth])
    displacements = [TrueField.load(path).sampled.markers for path in paths]

    def observed(true: FloatArray, seed: int, at: int) -> Observations:
        points = study.markers[case.layout]
        known = study.frame if at == 0 else FIXED
        shown = true if known.fixed else study.pressed_picture(points, seed).moved(points + true) - points
        return Observations(
            points=points,
            displacements=shown + np.random.default_rng([seed, at]).normal(0, study.noise, true.shape),
            standard_deviations=np.full_like(true, study.noise),
            visible=np.ones(len(true), dtype=bool),
            source=f"{source}, with {study.noise:g} mm of noise",
            simulated=True,
            marker_radius=study.design.marker_radius,
            pressed=known,
        )

    return [
        [observed(true, seed, at) for at, true in enumerate(displacements)] for seed in range(study.seeds)
    ]


def _results(
    study: CrossvalStudy, tasks: Mapping[tuple[Case, str], SolverTask], stages: Stages
) -> tuple[dict[Case, dict[str, SeedResults]], dict[Case, dict[str, str]]]:
    """By truth and layout the results of every solver, and the error messages of the solvers that failed."""

    def note(_: str, answer: list[list[FoldResult]] | str | ProcessFailed) -> str:
        if isinstance(answer, ProcessFailed):
            return answer.message
        return answer if isinstance(answer, str) else "scored"

    cases = list(dict.fromkeys(case for case, _ in tasks))
    named = {case.named(label, cases): (case, label) for case, label in tasks}
    order = {label: -place for place, (_, label) in enumerate(tasks)}
    # Slow solvers are usually named last: started first, they leave no processor idle at the end.
    ordered = {name: tasks[named[name]] for name in sorted(named, key=lambda name: order[named[name][1]])}
    answers = _answers(run_folds, ordered, study.processes, stages, "solvers", note)
    results: dict[Case, dict[str, SeedResults]] = {case: {} for case in cases}
    failed: dict[Case, dict[str, str]] = {case: {} for case in cases}
    for name, (case, label) in named.items():
        answer = answers[name]
        if isinstance(answer, list):
            results[case][label] = answer
        else:
            failed[case][label] = note(name, answer)
    if not all(results.values()):
        messages = {name: note(name, answers[name]) for name, (case, _) in named.items() if failed[case]}
        raise UserError("; ".join(f"{name}: {message}" for name, message in messages.items()))
    return results, failed


def _answers(
    work: Callable[[SolverTask, Progress], Answer],
    tasks: Mapping[str, SolverTask],
    processes: int,
    stages: Stages,
    kind: str,
    note: Callable[[str, Answer | ProcessFailed], str],
) -> dict[str, Answer | ProcessFailed]:
    """The answers of tasks by name: of those for a pool in processes, then of the others in this one."""
    pooled = {name: task for name, task in tasks.items() if task.for_pool}
    found = dict(in_stages(work, pooled, processes=processes, stages=stages, kind=kind, note=note))
    for name in (each for each in tasks if each not in pooled):
        with stages.stage(name) as progress:
            found[name] = work(tasks[name], progress)
            progress(1.0, note(name, found[name]))
    return found


def _sweeps(
    tasks: Mapping[tuple[Case, str], SolverTask],
    results: Mapping[Case, Mapping[str, SeedResults]],
    processes: int,
    stages: Stages,
) -> dict[Case, dict[str, list[float]]]:
    """The sweep of `sweep_weights` for each truth and layout, if its solver is there."""
    cases = {
        f"{case.truth}, {case.layout}": case
        for case, each in results.items()
        if SWEPT in each and isinstance(tasks[case, SWEPT].variant.solver, FemAsmSolver)
    }
    swept = {name: tasks[case, SWEPT] for name, case in cases.items()}
    answers = _answers(sweep_weights, swept, processes, stages, "curves", lambda *_: "weighed")
    found = {case: answers[name] for name, case in cases.items()}  # in this order, whichever ended first
    return {case: each for case, each in found.items() if not isinstance(each, ProcessFailed)}
