"""Cross-validation: solvers judged by markers, loads and fields that they were not given."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from compare.crossval_curve import CURVED, weigh
from compare.crossval_folds import LOAD, SCHEMES, Condition, Fold, conditions_of, folds_of
from compare.crossval_run import Entry, Failed, Outcome, Task, judge
from compare.crossval_scores import COMPARED, LEVEL, Difference, Score, difference, of_scheme, score
from compare.crossval_truth import FINER, Truth, TruthTask, find_truth
from compare.kept_folder import check_kept_folder
from compare.pipeline import check_inside
from compare.processes import ProcessFailed
from compare.provenance import machine, package_versions, sources_digest
from compare.staged_processes import in_stages
from compare.stages import Stages
from compare.virtual_experiment import said_of
from geometry.atomic import write_json
from geometry.cache import finger_mesh
from geometry.design import Design
from geometry.errors import UserError
from geometry.mesh import TriangleMesh
from geometry.observations import Observations
from geometry.settings import MeshSettings
from solvers.assimilation import assimilates
from solvers.problem import Load, Material, Problem
from solvers.solver import check_load, with_law
from vision.measurements import read_measurements

DEFINITION = "definition.json"
PARTS, PACKAGES = ("folds", "run", "truth"), ("geometry", "solvers")
"""Of the program, whose change makes new folds."""

BASELINES = ("fem", "gp")
"""Solvers from which differences are told."""


@dataclass(frozen=True)
class Study:
    """What to cross-validate, and where to write.

    Attributes:
        design: The finger.
        mesh: Element sizes of the mesh that solvers share.
        material: The elastic constants; each solver takes the law that it has.
        load: What moves the finger.
        entries: The solvers.
        schemes: Keys of `SCHEMES`.
        seeds: How often noise is drawn, and random numbers of solvers.
        noise: Standard deviation of a simulated marker's displacement, mm.
        measurements: CSV file of marker displacements; None for the virtual experiment.
        out: Output folder; what an earlier study with the same settings finished there is taken over.
        processes: How many solvers are judged at a time.
        threads: Threads of each.
    """

    design: Design
    mesh: MeshSettings
    material: Material
    load: Load
    entries: Sequence[Entry]
    schemes: Sequence[str]
    seeds: int
    noise: float
    measurements: Path | None
    out: Path
    processes: int
    threads: int


@dataclass(frozen=True, eq=False)
class Result:
    """A finished study.

    Attributes:
        study: What was asked for.
        source: One sentence on where the markers' displacements come from.
        markers: How many there are.
        folds: What was held out.
        scores: By solver and scheme.
        differences: By solver, baseline, scheme and entry of `COMPARED`.
        failed: What solvers that have no score ended with.
    """

    study: Study
    source: str
    markers: int
    folds: Sequence[Fold]
    scores: Mapping[str, Mapping[str, Score]]
    differences: Mapping[str, Mapping[str, Mapping[str, Mapping[str, Difference]]]]
    failed: Mapping[str, str]

    @property
    def schemes(self) -> list[str]:
        """Those that there are folds of, in the usual order."""
        present = {fold.scheme for fold in self.folds}
        return [scheme for scheme in SCHEMES if scheme in present]


def crossval(study: Study, stages: Stages) -> Result:
    """Judge the solvers and write the output folder.

    Raises:
        UserError: If it cannot be done, or the folder holds something else.
    """
    started = datetime.now(UTC)
    _check(study)
    given = _seen(read_measurements(study.measurements)) if study.measurements else None
    definition = _definition(study, given)
    check_kept_folder(study.out / DEFINITION, definition, job="cross-validation")
    with stages.stage("mesh"):
        mesh = finger_mesh(study.design, settings=study.mesh)
        if given:
            check_inside(given, mesh)
        problem = Problem(mesh, study.material, study.load)
    conditions = conditions_of(problem, others=LOAD in study.schemes and given is None)
    from compare.crossval_output import write_results
    from compare.output_folder import locked

    study.out.mkdir(parents=True, exist_ok=True)
    with locked(study.out):
        write_json(study.out / DEFINITION, definition)
        shared = study.out / "mesh.npz"
        mesh.save(shared)
        truths = [] if given else _truths(study, conditions, shared, stages)
        observations = _observations(study, mesh, given, truths)
        folds = folds_of(study.schemes, len(observations[0][0].points), conditions)
        tasks = {
            entry.label: Task(
                entry=entry,
                mesh=shared,
                material=study.material,
                conditions=conditions,
                truths=truths,
                observations=observations,
                folds=folds,
                radius=study.design.marker_diameter / 2,
                folder=study.out / "runs" / entry.file_name,
                threads=study.threads,
            )
            for entry in study.entries
        }
        outcomes, failed = _judged(study, tasks, stages)
        curve = _curve(tasks, outcomes, stages) if truths else {}
        result = _result(study, observations[0][0], folds, outcomes, failed)
        provenance = {
            "started": started.isoformat(timespec="seconds"),
            "seconds": {name: round(seconds, 2) for name, seconds in stages.seconds.items()},
            "problem_sha256": problem.digest,
            "machine": machine(),
        }
        with stages.stage("report"):
            write_results(study.out, result, outcomes, curve, {**definition, **provenance})
    return result


def _check(study: Study) -> None:
    """Refuse what cannot be done before anything is computed."""
    labels = [entry.label for entry in study.entries]
    if len(set(labels)) < len(labels):
        raise UserError(f"a solver is named twice: {', '.join(labels)}")
    for entry in study.entries:
        solver = entry.make(0)
        check_load(solver, study.load)
        with_law(study.material, solver)
    if study.measurements is None and study.load.displacement[1] is None:
        raise UserError("the virtual experiment presses on the finger: prescribe v")


def _seen(observations: Observations) -> Observations:
    """Only the markers that were seen, of which there must be some to hold out and some to give."""
    seen = observations.visible
    if (count := int(seen.sum())) < 3:
        raise UserError(f"cross-validation needs 3 markers that were seen, not {count}")
    order = np.flatnonzero(seen)[observations.points[seen, 0].argsort(kind="stable")]
    return replace(
        observations,
        points=observations.points[order],
        displacements=observations.displacements[order],
        standard_deviations=observations.standard_deviations[order],
        visible=seen[order],
    )


def _definition(study: Study, given: Observations | None) -> dict[str, Any]:
    """Everything that what is kept depends on, but for the solvers' settings, which are kept with it."""
    measured = given and [
        values.tolist() for values in (given.points, given.displacements, given.standard_deviations)
    ]
    content = {
        "schema": 1,
        "design": study.design.model_dump(),
        "mesh": study.mesh.model_dump(),
        "material": study.material.model_dump(),
        "load": study.load.model_dump(mode="json"),
        "noise_mm": None if given else study.noise,
        "measured": measured,
        "versions": package_versions(),
        "program_sha256": sources_digest(
            [
                "compare.crossval_run",
                "compare.crossval_folds",
                "compare.crossval_truth",
                "geometry",
                "solvers",
            ]
        ),
    }
    return dict(json.loads(json.dumps(content)))


def _truths(study: Study, conditions: Sequence[Condition], shared: Path, stages: Stages) -> list[Path]:
    """The true fields at every load, each simulated in a process of its own."""
    stroke = -float(study.load.displacement[1] or 0.0)
    tasks = {
        f"truth, {condition.name}": TruthTask(
            design=study.design.replaced(contact_position=condition.contact),
            settings=study.mesh,
            shared=shared,
            radius=study.design.marker_diameter / 2,
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
    source = f"{said_of(Problem(mesh, study.material, study.load))}, with {study.noise:g} mm of noise"
    displacements = [Truth.load(path).markers for path in truths]
    return [
        [
            Observations(
                points=mesh.markers,
                displacements=true + np.random.default_rng([seed, at]).normal(0, study.noise, true.shape),
                standard_deviations=np.full_like(true, study.noise),
                visible=np.ones(len(true), dtype=bool),
                source=source,
                simulated=True,
            )
            for at, true in enumerate(displacements)
        ]
        for seed in range(study.seeds)
    ]


def _judged(
    study: Study, tasks: Mapping[str, Task], stages: Stages
) -> tuple[dict[str, list[list[Outcome]]], dict[str, str]]:
    """The outcomes of every solver, and what went wrong with the others."""

    def note(_: str, answer: list[list[Outcome]] | Failed | ProcessFailed) -> str:
        if isinstance(answer, ProcessFailed):
            return f"its process ended with exit code {answer.exit_code}"
        return answer.message if isinstance(answer, Failed) else "judged"

    outcomes, failed = {}, {}
    for name, answer in in_stages(
        judge, tasks, processes=study.processes, stages=stages, kind="solvers", note=note
    ):
        if isinstance(answer, list):
            outcomes[name] = answer
        else:
            failed[name] = note(name, answer)
    if not outcomes:
        raise UserError("; ".join(f"{name}: {message}" for name, message in failed.items()))
    return {name: outcomes[name] for name in tasks if name in outcomes}, failed


def _curve(
    tasks: Mapping[str, Task], outcomes: Mapping[str, list[list[Outcome]]], stages: Stages
) -> dict[str, list[float]]:
    """What more weight of the markers does to `fem-asm`, if it is there; see `weigh`."""
    wanted = {"weights": tasks[CURVED]} if CURVED in outcomes else {}
    curve: dict[str, list[float]] = {}
    for _, answer in in_stages(
        weigh, wanted, processes=1, stages=stages, kind="curves", note=lambda *_: "weighed"
    ):
        curve = {} if isinstance(answer, ProcessFailed) else answer
    return curve


def _result(
    study: Study,
    observations: Observations,
    folds: Sequence[Fold],
    outcomes: Mapping[str, list[list[Outcome]]],
    failed: Mapping[str, str],
) -> Result:
    schemes = list(dict.fromkeys(fold.scheme for fold in folds))
    by_scheme = {
        label: {scheme: of_scheme(each, scheme) for scheme in schemes} for label, each in outcomes.items()
    }
    differences = {
        label: {
            baseline: {
                scheme: {
                    what: found
                    for what in COMPARED
                    if (found := difference(each[scheme], by_scheme[baseline][scheme], what)) is not None
                }
                for scheme in schemes
            }
            for baseline in BASELINES
            if baseline in by_scheme and baseline != label
        }
        for label, each in by_scheme.items()
    }
    return Result(
        study=study,
        source=observations.source,
        markers=len(observations.points),
        folds=folds,
        scores={
            label: {scheme: score(entries) for scheme, entries in each.items()}
            for label, each in by_scheme.items()
        },
        differences=differences,
        failed=failed,
    )


def content_of(result: Result) -> dict[str, Any]:
    """What `crossval.json` says of a result."""
    return {
        "measurements": {"description": result.source, "markers": result.markers},
        "seeds": result.study.seeds,
        "level": LEVEL,
        "truth": f"elements of {FINER:g} times the size" if result.study.measurements is None else None,
        "folds": [asdict(fold) for fold in result.folds],
        "schemes": {scheme: SCHEMES[scheme] for scheme in result.schemes},
        "solvers": {
            entry.label: {
                "solver": entry.solver,
                "settings": dict(entry.settings),
                "assimilates": assimilates(entry.make(0)),
                "schemes": {scheme: asdict(found) for scheme, found in result.scores[entry.label].items()},
                "against": {
                    baseline: {
                        scheme: {what: {**asdict(one), "verdict": one.verdict} for what, one in each.items()}
                        for scheme, each in by_scheme.items()
                    }
                    for baseline, by_scheme in result.differences[entry.label].items()
                },
            }
            for entry in result.study.entries
            if entry.label in result.scores
        },
        "failed": dict(result.failed),
    }
