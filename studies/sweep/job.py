"""A study to run: where it is read and written, and its samples as tasks for workers."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import floor
from pathlib import Path
from typing import Any, Generic, TypeVar

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.drawing.drawn_finger import finger_from
from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.finger.parameters import Parameters, parameter_info
from pinnray.geometry.finger.presets import load_design
from pinnray.geometry.finger.rules import markers_apart, markers_fit
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.runtime.content_hash import sources_digest
from pinnray.runtime.errors import UserError
from pinnray.runtime.machine import package_versions
from pinnray.solvers.problem import Problem
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solver import Solver, check_load
from pinnray.studies.sweep.field_path import moving_mesh, stepping
from pinnray.studies.sweep.study import PHYSICS, Study, Value, physics_of

LEAST_MARKERS = {name: float(parameter_info(name, "low")) for name in ("marker_diameter", "marker_height")}
"""Markers of the fingers of a study: their size changes no quantity, so that none is refused for it."""


@dataclass(frozen=True)
class FieldOrder:
    """Where the field of a sample is kept, at how many strokes, and the finger whose mesh moves."""

    file: Path
    strokes: int
    base: str  # As JSON


@dataclass(frozen=True)
class Task:
    """One sample as a worker gets it.

    Attributes:
        number: Of the sample in its study.
        definition: Of the finger; rules are checked by the worker.
        mesh: Element sizes.
        physics: Values of `Physics`.
        solver: Name of the solver.
        settings: Its settings.
        density: Of the material, g/cm^3.
        checkpoints: Folder of a training that can be resumed; None for none.
        fields: The field to keep; None for none.
    """

    number: int
    definition: dict[str, Any]
    mesh: MeshSettings
    physics: dict[str, Any]
    solver: str
    settings: dict[str, Value]
    density: float
    checkpoints: Path | None = None
    fields: FieldOrder | None = None

    def problem(self) -> tuple[Solver, Problem]:
        """The solver and its problem, on a mesh that moves with the finger where its field is kept.

        Raises:
            UserError: If they cannot be made, or the solver does not take them.
        """
        finger = finger_from(self.definition)
        material, load = physics_of(self.physics)
        solver: Solver = make_solver(self.solver, **self.settings)
        if self.fields and isinstance(finger, Design):
            mesh = moving_mesh(self.fields.base, self.mesh).of(finger)
            load = load.model_copy(update={"position": finger.contact_abscissa})
            solver = stepping(solver, self.fields.strokes)
        else:
            mesh = finger_mesh(finger, settings=self.mesh, keep=self.checkpoints is not None)
        return solver, Problem(mesh, material, load, finger=finger)


def field_base(study: Study, definition: Mapping[str, Any]) -> dict[str, Any]:
    """The definition of the finger in the middle of a study's ranges, whose mesh follows all others."""
    shape = {name: value for name, value in study.fixed.items() if name in Parameters.model_fields}
    middle = {name: value for name, value in study.middle.items() if name in Parameters.model_fields}
    return {**definition, **shape, **LEAST_MARKERS, **middle, "name": study.name}


def field_file(out: Path, number: int) -> Path:
    """The file of a sample's field in the folder of its sweep."""
    return out / "fields" / f"{number:06d}.npz"


S = TypeVar("S", bound=Study)


@dataclass(frozen=True)
class StudyJob(Generic[S]):
    """A study to run, and its output folder; reads the design of the study once.

    Attributes:
        study: The study.
        folder: Folder from which paths in the study are meant.
        out: Output folder; samples that an earlier start finished there are kept.
        processes: Worker processes.
        finger: The finger from which the samples differ, in place of the study's design.
    """

    study: S
    folder: Path
    out: Path
    processes: int = 1
    finger: Finger | None = None

    def task(self, number: int, sample: Mapping[str, Value]) -> Task:
        """The task of a sample.

        Raises:
            UserError: If a file cannot be read, the solver does not take the load, or a drawing is varied.
        """
        study = self.study
        settings = study.settings_of(sample)
        given = {**study.fixed, **sample}
        values = {name: value for name, value in given.items() if not name.startswith(f"{study.solver}.")}
        shape = {name: value for name, value in values.items() if name not in PHYSICS}
        if shape and not isinstance(self._base, Design):
            raise UserError(f"of a drawn finger a study changes material and load, not {next(iter(shape))}")
        checkpoints, fields, definition = None, None, {**self._base.definition(), **shape}
        if isinstance(self._base, Design) and not study.settings_alone:
            definition |= {key: least for key, least in LEAST_MARKERS.items() if key not in study.varied}
        if study.settings_alone:
            checkpoints = self.out / "runs" / "_".join(f"{key}-{value}" for key, value in settings.items())
        else:
            definition["name"] = f"{study.name}-{number}"
        if study.strokes is not None:
            base = json.dumps(field_base(study, self._base.definition()))
            fields = FieldOrder(field_file(self.out, number), study.strokes, base)
        return Task(
            number,
            definition,
            MeshSettings(size=study.mesh_size),
            {name: value for name, value in values.items() if name in PHYSICS},
            study.solver,
            {**study.settings, **settings},
            study.density,
            checkpoints,
            fields,
        )

    def marked(self, task: Task) -> dict[str, Any]:
        """The definition of a task's finger with the markers of the study, smaller where they must be."""
        given = {**self._base.definition(), **self.study.fixed}
        wanted = {name: given[name] for name in LEAST_MARKERS if name not in self.study.varied}
        least = Parameters(**task.definition)
        if "marker_diameter" in wanted:
            room = min(2 * markers_fit(least).margin, markers_apart(least).margin) + least.marker_diameter
            wanted["marker_diameter"] = min(wanted["marker_diameter"], floor(100 * room + 1e-6) / 100)
        return {**task.definition, **wanted}

    def definition(self, sample: Mapping[str, Value], module: str) -> dict[str, Any]:
        """The study, and everything else on which the results of a module depend."""
        study, finger = self.study, self.task(0, sample).definition
        described = study.model_dump(
            mode="json", by_alias=True, exclude_none=True, include=set(Study.model_fields)
        )
        described["fixed"] = {
            name: value for name, value in described["fixed"].items() if name not in LEAST_MARKERS
        }
        return {
            "schema": 1,
            "study": described,
            "finger": {name: value for name, value in finger.items() if name not in {"name", *study.varied}},
            "versions": package_versions(),
            "program_sha256": sources_digest(module, type(study.made_solver()).__module__),
        }

    @cached_property
    def _base(self) -> Finger:
        """The finger from which the samples differ; the solver is asked for its loads before."""
        study = self.study
        kinds = study.varied["load"].values if "load" in study.varied else None
        fixed = {name: value for name, value in study.fixed.items() if name in ("load", "friction")}
        for given in [{"load": kind} for kind in kinds] if kinds else [fixed]:
            check_load(study.made_solver(), physics_of(given)[1])
        near = self.folder / study.design
        return self.finger or load_design(near if near.suffix == ".toml" and near.is_file() else study.design)
