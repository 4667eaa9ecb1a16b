"""The fields that a sweep has kept, and the finger whose mesh they are on."""

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.design_motion import MovingMesh
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.runtime.text_files import read_json
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.studies.emulator.emulator import FEWEST
from pinnray.studies.emulator.inputs import Inputs
from pinnray.studies.sweep.field_path import FieldPath, moving_mesh
from pinnray.studies.sweep.job import field_base, field_file
from pinnray.studies.sweep.study import Study, Value
from pinnray.studies.sweep.sweep import STUDY_FILE, load_sweep


@dataclass(frozen=True, eq=False)
class KnownSamples:
    """The samples of a sweep that have a field, and those that found no equilibrium under the full load.

    Attributes:
        folder: Of the sweep.
        inputs: Reads the parameters of a sample.
        numbers: Of the samples with a field, s of them.
        samples: Values of their varied parameters.
        results: Their figures under the full load.
        lost: Values of the varied parameters of the others.
        reasons: Why these have no field.
    """

    folder: Path
    inputs: Inputs
    numbers: list[int]
    samples: list[dict[str, Value]]
    results: list[dict[str, float]]
    lost: list[dict[str, Value]]
    reasons: list[str]

    @classmethod
    def of(cls, folder: Path) -> Self:
        """The samples in the folder of a sweep.

        Raises:
            UserError: If it keeps no fields, or too few.
        """
        sweep = load_sweep(folder)
        if sweep.study.strokes is None:
            raise UserError(
                f"the sweep in {folder} keeps no fields; sweep a study with strokes = 10, which needs "
                "solver = 'fem-nonlinear' and a fixed load = 'cylinder', into another folder"
            )
        finger: dict[str, Any] = read_json(folder / STUDY_FILE, "sweep").get("finger", {})
        having = [each for each in sweep.good if field_file(folder, each.number).is_file()]
        if len(having) < FEWEST:
            raise UserError(
                f"the sweep in {folder} has kept {len(having)} fields, and an emulator needs {FEWEST}; "
                "let `pinnray sweep` finish, or raise samples in the study"
            )
        bad = [each for each in sweep.measurements if each.state in ("not converged", "refused")]
        return cls(
            folder,
            Inputs(sweep.study, finger),
            [each.number for each in having],
            [sweep.samples[each.number] for each in having],
            [each.values for each in having],
            [sweep.samples[each.number] for each in bad],
            [each.message for each in bad],
        )

    @property
    def study(self) -> Study:
        """The study."""
        return self.inputs.study

    @cached_property
    def meshes(self) -> MovingMesh:
        """Makes the mesh of a sample."""
        base = json.dumps(field_base(self.study, self.inputs.base))
        return moving_mesh(base, MeshSettings(size=self.study.mesh_size))


@dataclass(frozen=True, eq=False)
class Snapshots:
    """Fields of s samples, each at k equal strokes.

    Attributes:
        known: The samples.
        nodal: Displacements of the nodes of quadratic elements, shape (s, k, N, 2), mm.
        numbers: Values of `field_path.NUMBERS`, shape (s, k, 5).
    """

    known: KnownSamples
    nodal: FloatArray
    numbers: FloatArray

    @classmethod
    def load(cls, known: KnownSamples) -> Self:
        """The fields of samples.

        Raises:
            UserError: If a file is damaged.
        """
        paths = [FieldPath.load(field_file(known.folder, number)) for number in known.numbers]
        return cls(
            known, np.array([path.nodal for path in paths]), np.array([path.numbers for path in paths])
        )

    @cached_property
    def factors(self) -> FloatArray:
        """Young's modulus of every sample over that in the middle of the range, shape (s,)."""
        physics = self.known.inputs.physics
        own = np.array([physics(each)[0].young for each in self.known.samples])
        return own / physics(self.known.study.middle)[0].young

    @property
    def shares(self) -> FloatArray:
        """The strokes over the full one, shape (k,)."""
        count = self.nodal.shape[1]
        return np.arange(1, count + 1) / count

    @cached_property
    def space(self) -> LagrangeSpace:
        """Quadratic elements on the mesh at rest in the middle of the ranges."""
        return LagrangeSpace(self.known.meshes.mesh, 2)

    @cached_property
    def points(self) -> FloatArray:
        """Nodes of every sample's mesh, shape (s, n, 2), mm; of one row where no sample's mesh moves."""
        if not self.known.inputs.moves:
            return self.known.meshes.mesh.points[None]
        fingers = [Design(**self.known.inputs.parameters(each).model_dump()) for each in self.known.samples]
        return np.array([self.known.meshes.of(finger).points for finger in fingers])
