"""Tasks in processes of their own, a few at a time, that end with the program that started them.

Not `pebble.ProcessPool`: when the program is killed its workers go on until their task is done, when it is
interrupted they are killed before they can save their state, and they cannot report progress.
"""

import logging
import os
import signal
import sys
import warnings
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager, suppress
from ctypes import CDLL
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Generic, TypeVar

from compare.runtime.interruption import leave_signals_alone
from compare.runtime.provenance import cores
from compare.runtime.stages import Stages
from geometry.worker import SAFE_PATH
from solvers.solver import Progress

PR_SET_PDEATHSIG = 1
"""Of `prctl(2)`: the signal that a process gets when its parent ends."""

PATIENCE_S = 1.0
"""Time that an interrupted process has for its next report, s; then it is interrupted wherever it is."""

THREADS = "OMP_NUM_THREADS"
"""Variable that torch and OpenBLAS read when they are loaded."""

Input = TypeVar("Input")
Output = TypeVar("Output")


@dataclass(frozen=True)
class ProcessFailed:
    """A process that ended without an answer; its traceback, if it had one, is on standard error.

    Attributes:
        exit_code: Of the operating system; the negative number of the signal that ended it.
        reason: A file that could not be read or written, and why; empty for another end.
    """

    exit_code: int | None
    reason: str = ""

    @property
    def message(self) -> str:
        """The end of the process, as a clause."""
        return self.reason or f"its process ended with exit code {self.exit_code}"


@dataclass(frozen=True)
class _Done(Generic[Output]):
    """The last message of a process."""

    answer: Output


@dataclass(frozen=True)
class _Warned:
    """A warning in a process."""

    text: str


def in_processes(
    work: Callable[[Input, Callable[..., None]], Output],
    tasks: Mapping[str, Input],
    *,
    processes: int,
    report: Callable[..., None],
) -> Generator[tuple[str, Output | ProcessFailed], None, None]:
    """Run tasks in fresh processes and yield their answers as they come.

    Every process has its share of the cores as threads, unless `OMP_NUM_THREADS` is set: threads that wait
    for one another on cores of others take more than they give.

    When the iterator is closed or interrupted, or this process is killed, the next progress report of every
    running process raises KeyboardInterrupt there, so that it can save its state. One that reports nothing is
    interrupted as by SIGINT; one whose parent was killed then goes on to its end.

    Warnings in a process are warnings here, where Python shows a text only once.

    Args:
        work: A function of a module, called with a task and a function that reports progress.
        tasks: Tasks by name; they must be picklable.
        processes: Largest number of processes at a time.
        report: Called with the task's name and what it reports.
    """
    with suppress(ValueError):  # outside of the main thread, where it cannot be set
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)  # as Python does; PETSc ends the program at one
    context = get_context("spawn")
    waiting = dict(tasks)
    running: dict[Connection, tuple[str, SpawnProcess]] = {}
    try:
        while waiting or running:
            fresh: list[tuple[Connection, Input]] = []
            while waiting and len(running) < processes:
                name = next(iter(waiting))
                ours, theirs = context.Pipe()
                process = context.Process(target=_child, args=(work, theirs), name=name)
                with _environment(max(1, cores() // min(processes, len(tasks)))):
                    process.start()
                theirs.close()
                running[ours] = name, process
                fresh.append((ours, waiting.pop(name)))
            for connection, task in fresh:  # now that all have started: each reads when it has imported
                with suppress(OSError):  # it has ended already, which is found below
                    connection.send(task)
            ready = wait(list(running))
            for connection in [connection for connection in running if connection in ready]:
                name, process = running[connection]
                try:
                    message = connection.recv()
                except (EOFError, OSError):
                    process.join()
                    message = _Done(ProcessFailed(process.exitcode))
                if isinstance(message, _Done):
                    del running[connection]
                    process.join()
                    yield name, message.answer
                elif isinstance(message, _Warned):
                    warnings.warn(message.text, RuntimeWarning, stacklevel=2)
                else:
                    report(name, *message)
    finally:
        for connection in running:
            connection.close()
        for _, process in running.values():
            process.join(PATIENCE_S)
            if process.is_alive():
                process.terminate()
                process.join()


def in_stages(
    work: Callable[[Input, Progress], Output],
    tasks: Mapping[str, Input],
    *,
    processes: int,
    stages: Stages,
    kind: str,
    note: Callable[[str, Output | ProcessFailed], str],
) -> Generator[tuple[str, Output | ProcessFailed], None, None]:
    """`in_processes` with a stage for every task and one for all, of the name `kind`, such as "runs".

    `note` turns a task's name and its answer into a short text.
    """
    lines: dict[str, tuple[ExitStack, Progress]] = {}

    def report(name: str, fraction: float, text: str) -> None:
        if name not in lines:
            stack = ExitStack()
            lines[name] = stack, stack.enter_context(stages.stage(name))
        lines[name][1](fraction, text)

    with (
        stages.stage(kind) as overall,
        closing(in_processes(work, tasks, processes=processes, report=report)) as answers,
    ):
        for done, (name, answer) in enumerate(answers, start=1):
            yield name, answer
            report(name, 1.0, note(name, answer))
            lines[name][0].close()
            overall(done / len(tasks), f"{done} of {len(tasks)} {kind}")


@contextmanager
def _environment(threads: int) -> Iterator[None]:
    """Processes that start meanwhile have a number of threads and a safe path, unless the user chose."""
    added = {
        name: text for name, text in ({THREADS: str(threads)} | SAFE_PATH).items() if name not in os.environ
    }
    os.environ.update(added)
    try:
        yield
    finally:
        for name in added:
            del os.environ[name]


def end_with_parent() -> None:
    """Let the system kill this process when its parent ends, which it would notice at its next report.

    For a task that writes where the next run of its parent will. Elsewhere than on Linux this does nothing.
    """
    if sys.platform == "linux":
        CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def _child(work: Callable[[Input, Callable[..., None]], Output], connection: Connection) -> None:
    """Receive a task, run it and send its answer.

    Signals of the terminal reach this process through its parent.
    """
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    leave_signals_alone()  # PETSc would end the process when nobody listens

    def report(*message: object) -> None:
        try:
            connection.send(message)
        except OSError:  # nobody listens any more
            raise KeyboardInterrupt from None

    def warn(message: Warning | str, *_: object, **__: object) -> None:
        with suppress(OSError):  # nobody listens any more, and the next report ends the work
            connection.send(_Warned(str(message)))

    logging.captureWarnings(True)  # FFCx does when it is imported, which would undo the next line
    warnings.showwarning = warn
    answer: Output | ProcessFailed
    try:
        answer = work(connection.recv(), report)
    except EOFError:  # nobody asks any more
        return
    except KeyboardInterrupt:
        return
    except OSError as error:  # such as a full disk: no fault of the program
        answer = ProcessFailed(1, f"{error.filename or 'input or output'}: {error.strerror or error}")
    connection.send(_Done(answer))
