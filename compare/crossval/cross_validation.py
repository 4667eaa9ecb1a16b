"""Cross-validation: solvers judged by markers, loads and fields that they were not given."""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from compare.crossval.fold_results import FailedSolver, FoldResult, SolverTask, run_folds
from compare.crossval.folds import LOAD, LoadCase, folds_of, load_cases_of
from compare.crossval.l_curve import CURVED, sweep_weights
from compare.crossval.output_files import write_results
from compare.crossval.result import CrossvalResult
from compare.crossval.study import Study, check_study, definition_of, seen_markers
from compare.crossval.true_fields import TrueFields, TruthTask, find_truth
from compare.evaluation.shared_mesh import check_inside
from compare.evaluation.virtual_experiment import experiment_source
from compare.runtime.output_folder import locked
from compare.runtime.processes import ProcessFailed
from compare.runtime.provenance import machine
from compare.runtime.resumable_folder import check_resumable_folder
from compare.runtime.staged_processes import in_stages
from compare.runtime.stages import Stages
from geometry.atomic import write_json
from geometry.cache import finger_mesh
from geometry.errors import UserError
from geometry.mesh.triangle_mesh import TriangleMesh
from geometry.observations import Observations
from solvers.problem import Problem
from vision.measurements import read_measurements

DEFINITION = "definition.json"


def cross_validate(study: Study, stages: Stages) -> CrossvalResult:
    """Judge the solvers and write the output folder.

    Raises:
        UserError: If it cannot be done, or the folder holds something else.
    """
    started = datetime.now(UTC)
    check_study(study)
    given = None
    if study.measurements:
        radius = study.design.marker_radius
        given = seen_markers(read_measurements(study.measurements, marker_radius=radius))
    definition = definition_of(study, given)
    check_resumable_folder(study.out / DEFINITION, definition, job="cross-validation")
    with stages.stage("mesh"):
        mesh = finger_mesh(study.design, settings=study.mesh)
        if given:
            check_inside(given, mesh)
        problem = Problem(mesh, study.material, study.load)
    conditions = load_cases_of(problem, others=LOAD in study.schemes and given is None)
    study.out.mkdir(parents=True, exist_ok=True)
    with locked(study.out):
        write_json(study.out / DEFINITION, definition)
        shared = study.out / "mesh.npz"
        mesh.save(shared)
        truths = [] if given else _truths(study, conditions, shared, stages)
        observations = _observations(study, mesh, given, truths)
        folds = folds_of(study.schemes, len(observations[0][0].points), conditions)
        tasks = {
            entry.label: SolverTask(
                entry=entry,
                mesh=shared,
                material=study.material,
                conditions=conditions,
                truths=truths,
                observations=observations,
                folds=folds,
                folder=study.out / "runs" / entry.file_name,
                threads=study.threads,
            )
            for entry in study.entries
        }
        outcomes, failed = _judged(study, tasks, stages)
        curve = _curve(tasks, outcomes, stages) if truths else {}
        result = CrossvalResult.of(study, observations[0][0], folds, outcomes, failed)
        provenance = {
            "started": started.isoformat(timespec="seconds"),
            "seconds": {name: round(seconds, 2) for name, seconds in stages.seconds.items()},
            "problem_sha256": problem.digest,
            "machine": machine(),
        }
        with stages.stage("report"):
            write_results(study.out, result, outcomes, curve, {**definition, **provenance})
    return result


def _truths(study: Study, conditions: Sequence[LoadCase], shared: Path, stages: Stages) -> list[Path]:
    """The true fields at every load, each simulated in a process of its own."""
    stroke = -float(study.load.displacement[1] or 0.0)
    tasks = {
        f"truth, {condition.name}": TruthTask(
            design=study.design.replaced(contact_position=condition.contact),
            settings=study.mesh,
            shared=shared,
            material=study.material,
            stroke=condition.share * stroke,
        )
        for condition in conditions
    }
    found: dict[str, Path] = {}
    for name, answer in in_stages(
        find_truth,
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


def _observations(
    study: Study, mesh: TriangleMesh, given: Observations | None, truths: Sequence[Path]
) -> list[list[Observations]]:
    """What markers do, for each seed at each load: the truth with noise, or what was measured."""
    if given:
        return [[given] for _ in range(study.seeds)]
    source = (
        f"{experiment_source(Problem(mesh, study.material, study.load))}, with {study.noise:g} mm of noise"
    )
    displacements = [TrueFields.load(path).markers for path in truths]
    return [
        [
            Observations(
                points=mesh.markers,
                displacements=true + np.random.default_rng([seed, at]).normal(0, study.noise, true.shape),
                standard_deviations=np.full_like(true, study.noise),
                visible=np.ones(len(true), dtype=bool),
                source=source,
                simulated=True,
                marker_radius=study.design.marker_radius,
            )
            for at, true in enumerate(displacements)
        ]
        for seed in range(study.seeds)
    ]


def _judged(
    study: Study, tasks: Mapping[str, SolverTask], stages: Stages
) -> tuple[dict[str, list[list[FoldResult]]], dict[str, str]]:
    """The outcomes of every solver, and what went wrong with the others."""

    def note(_: str, answer: list[list[FoldResult]] | FailedSolver | ProcessFailed) -> str:
        if isinstance(answer, ProcessFailed):
            return f"its process ended with exit code {answer.exit_code}"
        return answer.message if isinstance(answer, FailedSolver) else "judged"

    outcomes, failed = {}, {}
    for name, answer in in_stages(
        run_folds, tasks, processes=study.processes, stages=stages, kind="solvers", note=note
    ):
        if isinstance(answer, list):
            outcomes[name] = answer
        else:
            failed[name] = note(name, answer)
    if not outcomes:
        raise UserError("; ".join(f"{name}: {message}" for name, message in failed.items()))
    return {name: outcomes[name] for name in tasks if name in outcomes}, failed


def _curve(
    tasks: Mapping[str, SolverTask], outcomes: Mapping[str, list[list[FoldResult]]], stages: Stages
) -> dict[str, list[float]]:
    """What more weight of the markers does to `fem-asm`, if it is there; see `sweep_weights`."""
    wanted = {"weights": tasks[CURVED]} if CURVED in outcomes else {}
    curve: dict[str, list[float]] = {}
    for _, answer in in_stages(
        sweep_weights, wanted, processes=1, stages=stages, kind="curves", note=lambda *_: "weighed"
    ):
        curve = {} if isinstance(answer, ProcessFailed) else answer
    return curve
