"""A cross-validation as a study: its samples are solvers in folds, by seed, truth and layout of markers."""

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np

from pinnray.comparison.evaluation.plausibility import check_positions, displacement_remarks, problem_remarks
from pinnray.comparison.evaluation.virtual_experiment import experiment_source
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.observations import Observations
from pinnray.geometry.picture_frame import FIXED
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.content_hash import content_hash
from pinnray.runtime.errors import UserError
from pinnray.runtime.machine import cores
from pinnray.runtime.processes.child import ProcessFailed
from pinnray.runtime.processes.pool import Pool, known_to_children
from pinnray.runtime.stages import Stages
from pinnray.solvers.problem import Problem
from pinnray.solvers.solver import Solver, Traits
from pinnray.studies.crossval.fold_runner import SolverTask, run_folds
from pinnray.studies.crossval.folds import LOAD, Fold, LoadCase, folds_of, load_cases_of
from pinnray.studies.crossval.report import write_results
from pinnray.studies.crossval.result import CrossvalResult
from pinnray.studies.crossval.scores import Sample, left_out_table
from pinnray.studies.crossval.study import CrossvalStudy, of_draw, visible_markers
from pinnray.studies.crossval.true_fields import TrueField, TruthTask, simulate_truth
from pinnray.studies.sweep.measurement import Measurement
from pinnray.studies.sweep.store import class_of, resumed
from pinnray.studies.sweep.sweep import run_tasks

DEFINITION = "definition.json"
Case = tuple[str, str]
"""A truth and a layout of its markers; with measurements both are called `measured` or `simulated`."""


def cross_validate(study: CrossvalStudy, stages: Stages | None = None) -> CrossvalResult:
    """Run every sample of a cross-validation that has no result yet, and keep each result at once.

    Solvers run in processes of their own; one whose class those cannot import, such as a class of the calling
    script or notebook, runs in this process after them.

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
    with stages.stage("mesh"):
        mesh = finger_mesh(study.design, settings=study.mesh)
        if given:
            check_positions(given, mesh)
        problem = Problem(mesh, study.material, study.load)
        remarks = displacement_remarks(given, problem) if given else []
        for remark in [*problem_remarks(problem), *remarks]:
            warnings.warn(remark, stacklevel=2)
    load_cases = load_cases_of(problem, others=LOAD in study.schemes and given is None)
    threads = max(1, cores() // min(study.processes, len(study.solvers)))
    with (
        resumed(study.out / DEFINITION, definition, job="cross-validation") as (journal, _),
        Pool(study.processes, threads=threads) as pool,
    ):
        truths: dict[str, dict[str, list[TrueField]]] = {}
        if given:
            observations = {(given.label, given.label): [[given]] * study.seeds}
        else:
            truths = _true_fields(study, mesh, load_cases, pool, stages)
            observations = _noisy(study, truths, problem)
        wanted = dict(_samples(study, observations, load_cases))
        journal.forget("failed")
        known, solvers = journal.numbers(), {solver.name: solver for solver in study.solvers}
        missing: dict[tuple[str, str, str], dict[int, dict[str, Fold]]] = {}
        for name, sample in wanted.items():
            if name not in known:
                missing.setdefault(sample[:3], {}).setdefault(sample.seed, {})[name] = sample.fold
        tasks = [
            SolverTask(
                f"{label}, {truth}, {layout}",
                replace(problem, finger=study.design),
                solvers[label],
                load_cases,
                truths[truth][layout] if truths else [],
                observations[truth, layout],
                folds,
                study.chosen_truths.get(truth),
            )
            for (truth, layout, label), folds in missing.items()
        ]
        with stages.stage("samples") as progress:
            run = partial(run_tasks, run_folds, samples=wanted, journal=journal, progress=progress, deaths=1)
            # Slow solvers are usually named last: started first, they leave no processor idle at the end.
            pooled = [task for task in reversed(tasks) if known_to_children(task.solver)]
            run({task.name: task for task in pooled}, pool=pool)
            run({task.name: task for task in tasks if task not in pooled}, pool=None)
        found = _result(study, wanted, journal.measurements(), observations, truths)
        with stages.stage("report"):
            write_results(found, {**definition, "problem_sha256": problem.digest, **stages.record()})
    for remark in found.remarks:
        warnings.warn(remark, stacklevel=2)
    return found


def _true_fields(
    study: CrossvalStudy, mesh: TriangleMesh, load_cases: Sequence[LoadCase], pool: Pool, stages: Stages
) -> dict[str, dict[str, list[TrueField]]]:
    """The true fields at every load by truth and layout, each simulated in a process."""
    own = replace(study, solvers=())  # other processes may not know the classes of all solvers
    tasks = {
        (truth.name, case.name): TruthTask(own, truth, case, mesh)
        for truth in study.chosen_truths.values()
        for case in load_cases
    }
    found: dict[tuple[str, str], dict[str, TrueField]] = {}
    with stages.stage("truths") as progress:
        for (truth, load), answer in pool.answers(simulate_truth, tasks, deaths=1):
            if isinstance(answer, ProcessFailed):
                raise UserError(
                    f"truth {truth}, {load}: the virtual experiment did not come to its end; press less, "
                    f"drop the truth or {LOAD}, or give measurements"
                )
            found[truth, load] = answer
            progress(len(found) / len(tasks), f"{len(found)} of {len(tasks)} truths")
    return {
        truth: {layout: [found[truth, case.name][layout] for case in load_cases] for layout in study.markers}
        for truth in study.chosen_truths
    }


def _noisy(
    study: CrossvalStudy, truths: Mapping[str, Mapping[str, Sequence[TrueField]]], problem: Problem
) -> dict[Case, list[list[Observations]]]:
    """True marker displacements with noise, for each seed at each load; the noise is equal in every truth."""

    def observed(true: FloatArray, truth: str, layout: str, seed: int, at: int) -> Observations:
        points = study.markers[layout]
        known = study.frame if at == 0 else FIXED
        shown = true if known.fixed else study.pressed_picture(points, seed).moved(points + true) - points
        own = study.chosen_truths[truth]
        source = experiment_source(replace(problem, load=own.reached(problem.load)), own)
        return Observations(
            points=points,
            displacements=shown + np.random.default_rng([seed, at]).normal(0, study.noise, true.shape),
            standard_deviations=study.noise,
            source=f"{source}, with {study.noise:g} mm of noise",
            simulated=True,
            solid=own.solid,
            marker_radius=study.design.marker_radius,
            pressed=known,
        )

    found = {}
    for truth, layouts in truths.items():
        for layout, fields in layouts.items():
            found[truth, layout] = [
                [observed(field.sampled.markers, truth, layout, seed, at) for at, field in enumerate(fields)]
                for seed in range(study.seeds)
            ]
    return found


def _samples(
    study: CrossvalStudy,
    observations: Mapping[Case, Sequence[Sequence[Observations]]],
    load_cases: Sequence[LoadCase],
) -> Iterator[tuple[str, Sample]]:
    """Every sample by its name in the journal, which tells all that its result depends on."""
    digests = {solver.name: _digests(solver, study.seeds) for solver in study.solvers}
    for (truth, layout), seeds in observations.items():
        folds = folds_of(study.schemes, len(seeds[0][0].points), load_cases)
        for solver, each in digests.items():
            for (seed, digest), fold in product(enumerate(each), folds):
                name = f"{truth}, {layout}, {solver}, {seed}, {fold.scheme}, {fold.name}, {digest}"
                yield name, Sample(truth, layout, solver, seed, fold)


def _digests(solver: Solver, seeds: int) -> list[str]:
    """Digests of a solver's class, source and settings; other ones each time if the class has no source."""
    own = class_of(solver)
    return [content_hash([*own, of_draw(solver, seed).settings()]) for seed in range(seeds)]


def _result(
    study: CrossvalStudy,
    wanted: Mapping[str, Sample],
    measurements: Sequence[Measurement],
    observations: Mapping[Case, Sequence[Sequence[Observations]]],
    truths: Mapping[str, Mapping[str, Sequence[TrueField]]],
) -> CrossvalResult:
    """The result of the samples; the solvers that failed with a truth and layout have no score there.

    Raises:
        UserError: If all solvers have failed with one of them.
    """
    failed = {each.number: each.message for each in measurements if each.state == "failed"}
    found = {each.number: each for each in measurements}
    takes = {solver.name: Traits.of(solver).assimilates for solver in study.solvers}
    rows = [
        (sample, takes[sample.solver], found[name])
        for name, sample in wanted.items()
        if f"{sample.solver}, {sample.truth}, {sample.layout}" not in failed
    ]
    if {(sample.truth, sample.layout) for sample, *_ in rows} < observations.keys():
        raise UserError("; ".join(f"{name}: {message}" for name, message in failed.items()))
    return CrossvalResult(
        study,
        left_out_table(rows),
        {truth: seeds[0][0].origin for (truth, _), seeds in observations.items()},
        {truth: next(iter(each.values()))[0] for truth, each in truths.items()},
        failed,
    )
