"""An entry of the benchmark: a solver's rows in one JSON file, to which a pull request can add."""

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Self

from pydantic import TypeAdapter, ValidationError

from pinnray.runtime.atomic import write_json
from pinnray.runtime.errors import UserError
from pinnray.runtime.text_files import read_json
from pinnray.studies.benchmark.problems import ProblemSet

SCHEMA = 1


@dataclass(frozen=True)
class EntryRow:
    """A solver on one problem; numbers are None where there is no result."""

    problem: str
    state: str  #: done, not converged, refused (the solver cannot do it), out of time or failed
    message: str
    displacement: float | None = None  #: Relative L2 errors over the body
    von_mises: float | None = None
    von_mises_away: float | None = None  #: A wall's thickness away from corners and contact
    force: float | None = None  #: Relative, with sign
    energy: float | None = None  #: Excess over the reference's, relative
    base: float | None = None  #: Largest displacement of the base over the stroke
    contact: float | None = None  #: What the mean at the contact lacks to the load's, over the stroke
    seconds: float | None = None  #: Processor time, s
    times_fem: float | None = None  #: The same as a multiple of what `fem` takes
    memory: float | None = None  #: Most memory of the process, GB
    claimed: dict[str, float | bool] = field(default_factory=dict)
    broken: list[str] = field(default_factory=list)  #: Claims that are not true


@dataclass(frozen=True)
class Entry:
    """A solver with its settings on a set of problems."""

    label: str  #: Its name, with the preset if it has one
    settings: dict[str, Any]
    problems: dict[str, Any]  #: Name, version and hash of the set
    time_limit_s: float
    versions: dict[str, str]
    machine: dict[str, Any]
    rows: list[EntryRow]
    note: str = ""  #: What differs from its authors' settings
    schema: int = SCHEMA

    @property
    def file_name(self) -> str:
        """Name of its file."""
        return f"{'-'.join([*self.label.split(), self.problems['name']])}.json"

    def save(self, folder: Path) -> Path:
        """Write it into a folder."""
        write_json(folder / self.file_name, asdict(self))
        return folder / self.file_name

    @classmethod
    def load(cls, file: Path) -> Self:
        """The one in a file.

        Raises:
            UserError: If it is none.
        """
        content = read_json(file, "entry of the benchmark")
        try:
            return TypeAdapter(cls).validate_python(content)
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(map(str, first["loc"]))
            raise UserError(f"{file} is no entry of the benchmark: {place}: {first['msg'].lower()}") from None


def load_entries(folder: Path, problems: ProblemSet) -> tuple[list[Entry], list[str]]:
    """The entries in a folder for a set of problems, and remarks on those of its other versions, left out.

    Raises:
        UserError: If the folder is missing, or a file in it is no entry.
    """
    if not folder.is_dir():
        raise UserError(f"there is no folder {folder} of entries")
    every = {file.name: Entry.load(file) for file in sorted(folder.glob("*.json"))}
    named = {name: each for name, each in every.items() if each.problems["name"] == problems.name}
    fitting = [each for each in named.values() if each.problems == problems.described]
    left_out = [name for name, each in named.items() if each not in fitting]
    remark = f"left out, since they are of another version of the set {problems.name}: {', '.join(left_out)}"
    return fitting, [remark] if left_out else []


def entry_label(solver: Any) -> str:
    """The name of a solver, with its preset if it has one."""
    preset = solver.settings().get("preset")
    return " ".join(filter(None, [solver.name, preset]))
