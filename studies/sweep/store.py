"""The journal of a study: an SQLite file with one row for every finished sample.

Only the process that runs the study writes to it, a row in a transaction: after a kill at any moment a sample
is in it as a whole or not at all.
"""

import json
import sqlite3
from collections.abc import Collection, Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from secrets import token_hex
from typing import Any

from pinnray.runtime.atomic import write_json
from pinnray.runtime.content_hash import has_source, sources_digest
from pinnray.runtime.errors import UserError
from pinnray.runtime.output_folder import check_resumable_folder, locked
from pinnray.solvers.solver import Solver
from pinnray.studies.sweep.measurement import Measurement

JOURNAL = "journal.sqlite"

_TABLE = """
create table if not exists samples (
    number primary key, -- or a name
    state text not null,
    message text not null,
    seconds real not null,
    quantities text not null
)
"""


class Journal:
    """Finished samples on disk; made by `opened`."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        self._connection = connection
        with connection:
            connection.execute(_TABLE)

    def add(self, measurement: Measurement) -> None:
        """Keep a sample's result.

        Raises:
            sqlite3.IntegrityError: If it has one already.
        """
        row = (measurement.number, measurement.state, measurement.message, measurement.seconds)
        with self._connection:
            self._connection.execute(
                "insert into samples values (?, ?, ?, ?, ?)", (*row, json.dumps(measurement.values))
            )

    def forget(self, state: str, message: str = "") -> None:
        """Remove the samples whose state and message start so."""
        with self._connection:
            self._connection.execute(
                "delete from samples where state like ? and message like ?", (f"{state}%", f"{message}%")
            )

    def numbers(self) -> set[Any]:
        """Numbers of the samples that have a result."""
        return {number for (number,) in self._connection.execute("select number from samples")}

    def measurements(self) -> list[Measurement]:
        """Every result, ordered by the samples' numbers."""
        rows = self._connection.execute(
            "select number, state, message, seconds, quantities from samples order by number"
        )
        return [
            Measurement(number, state, message, seconds, json.loads(values))
            for number, state, message, seconds, values in rows
        ]


@contextmanager
def resumed(
    file: Path, definition: Mapping[str, Any], *, job: str, free: Collection[str] = ()
) -> Iterator[tuple[Journal, dict[str, Any]]]:
    """The journal beside the definition of a study, which is written, while no other process uses the folder.

    For the arguments see `check_resumable_folder`; with the journal come the entries that it returns.
    """
    before = check_resumable_folder(file, definition, job=job, free=free)
    file.parent.mkdir(parents=True, exist_ok=True)
    with locked(file.parent):
        write_json(file, dict(definition))  # first: a folder without it is taken for someone's
        with opened(file.with_name(JOURNAL)) as journal:
            yield journal, before


@contextmanager
def opened(file: Path) -> Iterator[Journal]:
    """The journal in a file, which is made if it does not exist.

    Raises:
        UserError: If the file is no journal or cannot be written.
    """
    try:
        with closing(sqlite3.connect(file)) as connection:
            yield Journal(connection)
    except sqlite3.DatabaseError as error:
        raise UserError(
            f"cannot use {file}: {error}; free some space if the disk is full, else remove the file to run "
            "every sample again"
        ) from None


def class_of(solver: Solver) -> list[str]:
    """Module, name and source of a solver's class, for digests; another one each time if it has no source."""
    kind = type(solver)
    source = sources_digest(kind.__module__) if has_source(kind.__module__) else token_hex()
    return [kind.__module__, kind.__qualname__, source]
