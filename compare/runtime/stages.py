"""The stages of a run: their progress and how long each took."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from datetime import UTC, datetime
from types import TracebackType
from typing import Any, Self

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Column

from compare.runtime.provenance import machine
from solvers.solver import Progress as Report
from solvers.solver import UnsupportedProblemError

_quiet: ContextVar[bool] = ContextVar("quiet", default=False)


@contextmanager
def quiet_stages() -> Iterator[None]:
    """Let `Stages` that are made in the block show nothing."""
    token = _quiet.set(True)
    try:
        yield
    finally:
        _quiet.reset(token)


class Stages:
    """Shows a line with progress and time left for every stage; without a terminal, a line at its end."""

    def __init__(self, console: Console | None = None, *, quiet: bool = False) -> None:
        console, quiet = console or Console(stderr=True), quiet or _quiet.get()
        self.seconds: dict[str, float] = {}  #: Duration of every finished stage, s.
        self._started = datetime.now(UTC)
        self._console = console
        self._log = not (quiet or console.is_terminal)
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=16),
            TaskProgressColumn(),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(compact=True),
            TextColumn(
                "{task.fields[note]}",
                style="dim",
                markup=False,
                table_column=Column(no_wrap=True, overflow="ellipsis", ratio=1),
            ),
            expand=True,
            console=console,
            disable=quiet or not console.is_terminal,
        )

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._progress.stop()

    def record(self) -> dict[str, Any]:
        """Start, durations so far and machine, for the provenance of a result."""
        return {
            "started": self._started.isoformat(timespec="seconds"),
            "seconds": {name: round(seconds, 2) for name, seconds in self.seconds.items()},
            "machine": machine(),
        }

    @contextmanager
    def stage(self, name: str) -> Iterator[Report]:
        """Run a stage; it yields a function that takes the fraction done and a short note."""
        started = time.perf_counter()
        task = self._progress.add_task(name, total=1.0, note="")
        last = ""

        def report(fraction: float, note: str) -> None:
            nonlocal last
            last = note
            self._progress.update(task, completed=fraction, note=note)

        try:
            yield report
        except UnsupportedProblemError:
            self._progress.remove_task(task)
            raise
        self._progress.update(task, completed=1.0)
        self.seconds[name] = time.perf_counter() - started
        if self._log:
            line = f"{name}: {self.seconds[name]:.1f} s{last and ', '}{last}"
            self._console.print(line, markup=False, highlight=False, soft_wrap=True)
