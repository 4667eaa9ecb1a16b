"""The problems of the benchmark: fingers, loads and materials that stay as they are within a version."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.drawing.drawn_finger import finger_from
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.runtime.content_hash import content_hash, file_digest
from pinnray.runtime.errors import UserError
from pinnray.solvers.problem import Problem
from pinnray.studies.sweep.study import physics_of

HERE = Path(__file__).parent
PROBLEMS = HERE / "problems.json"
REFERENCES = HERE / "references"
SIZES = MeshSettings(size=1.0)
"""Of the mesh that every solver gets: three elements across each wall and rib, of 1 mm at most."""
SETS = ("small", "full")


@dataclass(frozen=True, eq=False)
class BenchmarkProblem:
    """One problem of the set."""

    name: str
    definition: Mapping[str, Any]  #: Of the finger
    physics: Mapping[str, Any]  #: Words of `Physics`: law, load, stroke and so on
    elements: Mapping[str, float] = field(default_factory=dict)  #: Of its reference, where not the usual ones

    @property
    def finger(self) -> Finger:
        """The finger."""
        return finger_from(self.definition)

    @property
    def linear(self) -> bool:
        """Whether its law is the linear one."""
        return bool(self.physics["law"] == "linear")

    @property
    def words(self) -> str:
        """Law, Poisson's ratio, load and stroke in words."""
        given = dict(self.physics)
        said = f"{given.pop('law')}, nu = {given.pop('poisson')}, {given.pop('load')}"
        units = {"friction": ""}
        return ", ".join(
            [said, *(f"{name} {value:g}{units.get(name, ' mm')}" for name, value in given.items())]
        )

    @property
    def reference_file(self) -> Path:
        """The file of its reference."""
        return REFERENCES / f"{self.name}.npz"

    def made(self, sizes: MeshSettings = SIZES) -> Problem:
        """The problem on a mesh, by default the one that every solver gets."""
        material, load = physics_of(self.physics)
        finger = self.finger
        return Problem(finger_mesh(finger, settings=sizes), material, load, finger=finger)

    def timed(self) -> "BenchmarkProblem":
        """The linear problem of its finger with the load `mean`: the time of `fem` on it is the unit."""
        physics = {"law": "linear", "poisson": 0.45, "load": "mean", "stroke": self.physics["stroke"]}
        return replace(self, name=f"time on {self.definition['name']}", physics=physics)


@dataclass(frozen=True, eq=False)
class ProblemSet:
    """A fixed set of problems; equal hashes are equal problems and references."""

    name: str
    version: int
    problems: Sequence[BenchmarkProblem]

    @cached_property
    def digest(self) -> str:
        """SHA-256 of version, problems and references."""
        every = [
            [each.name, each.definition, each.physics, file_digest(each.reference_file)]
            for each in self.problems
        ]
        return content_hash([self.version, SIZES.model_dump(), every])

    @property
    def described(self) -> dict[str, Any]:
        """Name, version and hash, as an entry records them."""
        return {"name": self.name, "version": self.version, "sha256": self.digest}


def problem_set(name: str) -> ProblemSet:
    """The set with a name of `SETS`.

    Raises:
        UserError: If there is none.
    """
    if name not in SETS:
        raise UserError(f"no set of problems is called {name!r}; there are {' and '.join(SETS)}")
    content = json.loads(PROBLEMS.read_text(encoding="utf-8"))
    problems = [
        BenchmarkProblem(
            each["name"], content["fingers"][each["finger"]], each["physics"], each.get("elements", {})
        )
        for each in content["problems"]
        if each["small"] or name == "full"
    ]
    return ProblemSet(name, content["version"], problems)
