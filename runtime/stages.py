"""The stages of a run: their progress and how long each took."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from datetime import UTC, datetime
from math import inf
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

from pinnray.runtime.errors import InapplicableError
from pinnray.runtime.machine import machine
from pinnray.runtime.progress import Progress as Report

_quiet: ContextVar[bool] = ContextVar("quiet", default=False)


@contextmanager
def quiet_stages() -> Iterator[None]:
    """Let `Stages` that are made in the block show nothing."""
    token = _quiet.set(True)
    try:
        yield
    finally:
        _quiet.reset(token)


def shown_stages(shown: bool | None) -> "Stages":
    """Stages that are shown or not; if None, in a notebook only, which can show a line and change it."""
    return Stages(quiet=not (Console().is_jupyter if shown is None else shown))


class NotebookLine:
    """One line of a notebook's cell that changes, a few times a second at most."""

    EVERY = 0.2  # Time between two changes, s

    def __init__(self) -> None:
        from IPython.display import Pretty, display

        self._pretty, self._handle, self._last = Pretty, display(Pretty(""), display_id=True), -inf

    def show(self, text: str, *, now: bool = False) -> None:
        """Show a text in place of the last one; unless it has to be `now`, it may be passed over."""
        if now or time.perf_counter() - self._last >= self.EVERY:
            self._handle.update(self._pretty(text))
            self._last = time.perf_counter()


class Stages:
    """Shows a line with progress and time left for every stage; without a terminal, a line at its end.

    In a notebook it is one line for all of them, which ends as the list of their times.
    """

    def __init__(self, console: Console | None = None, *, quiet: bool = False) -> None:
        console, quiet = console or Console(stderr=True), quiet or _quiet.get()
        self.seconds: dict[str, float] = {}  #: Duration of every finished stage, s.
        self._started = datetime.now(UTC)
        self._console = console
        self._line = NotebookLine() if console.is_jupyter and not quiet else None
        self._told: dict[str, Stage] = {}
        self._log = not (quiet or console.is_terminal or console.is_jupyter)
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
        if self._line is not None and self.seconds:
            times = (f"{name} {seconds:.1f} s" for name, seconds in self.seconds.items())
            self._line.show(", ".join(times), now=True)

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
        stage = Stage(self, name)
        try:
            yield stage.report
        except InapplicableError:
            self._progress.remove_task(stage.task)
            raise
        stage.end()

    def told(self, name: str, *said: Any) -> None:
        """Show a stage of another process: it begins with its first report, and ends with an empty one."""
        stage = self._told.get(name) or self._told.setdefault(name, Stage(self, name))
        if said:
            stage.report(*said)
        else:
            self._told.pop(name).end()


class Stage:
    """A stage that has begun, and its line."""

    def __init__(self, stages: Stages, name: str) -> None:
        self._stages, self._name = stages, name
        self._started, self._note = time.perf_counter(), ""
        if stages._line is not None:
            stages._line.show(name)
        self.task = stages._progress.add_task(name, total=1.0, note="")

    def report(self, fraction: float, note: str) -> None:
        """Show the fraction done and a short note."""
        self._note = note
        self._stages._progress.update(self.task, completed=fraction, note=note)
        if self._stages._line is not None:
            self._stages._line.show(f"{self._name}: {fraction:.0%} {note}")

    def end(self) -> None:
        """Note how long it took."""
        stages, note = self._stages, self._note
        stages._progress.update(self.task, completed=1.0)
        stages.seconds[self._name] = seconds = time.perf_counter() - self._started
        if stages._log:
            line = f"{self._name}: {seconds:.1f} s{note and ', '}{note}"
            stages._console.print(line, markup=False, highlight=False, soft_wrap=True)
