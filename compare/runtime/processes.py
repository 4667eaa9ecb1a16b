"""Tasks in processes of their own, some at a time, that end with the program that started them."""

import os
import signal
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Generic, TypeVar

from solvers.solver import Progress

Input = TypeVar("Input")
Output = TypeVar("Output")


@dataclass(frozen=True)
class ProcessFailed:
    """A process ended without an answer; its traceback, if it had one, is on standard error.

    Attributes:
        exit_code: As of the operating system; the negative number of the signal that ended it.
    """

    exit_code: int | None


@dataclass(frozen=True)
class _Done(Generic[Output]):
    """The last message of a process."""

    answer: Output


def in_processes(
    work: Callable[[Input, Progress], Output],
    tasks: Mapping[str, Input],
    *,
    processes: int,
    report: Callable[[str, float, str], None],
) -> Generator[tuple[str, Output | ProcessFailed], None, None]:
    """Do tasks in fresh processes, at most so many at a time, and give their answers as they come.

    When the iterator is closed, or interrupted, the progress report of every process still at work raises
    KeyboardInterrupt there, so that it can save its state. The same happens if this process is killed.

    Args:
        work: What to do with a task; a function of a module, called with the task and a progress report.
        tasks: By name; what can be pickled.
        processes: The most processes.
        report: Called with the task's name and what its progress report was called with.
    """
    context = get_context("spawn")
    waiting = dict(tasks)
    running: dict[Connection, tuple[str, SpawnProcess]] = {}
    try:
        while waiting or running:
            while waiting and len(running) < processes:
                name = next(iter(waiting))
                ours, theirs = context.Pipe(duplex=False)
                process = context.Process(target=_child, args=(work, waiting.pop(name), theirs), name=name)
                process.start()
                theirs.close()
                running[ours] = name, process
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
                else:
                    report(name, *message)
    finally:
        for connection in running:
            connection.close()
        for _, process in running.values():
            process.join()


def _child(work: Callable[[Input, Progress], Output], task: Input, connection: Connection) -> None:
    """Do a task and send the answer; Ctrl-C on a terminal reaches this process by way of its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # PETSc would end the process, with a page of text, when nobody listens.
    os.environ["PETSC_OPTIONS"] = f"{os.environ.get('PETSC_OPTIONS', '')} -no_signal_handler"

    def report(fraction: float, text: str) -> None:
        try:
            connection.send((fraction, text))
        except OSError:  # nobody listens any more
            raise KeyboardInterrupt from None

    try:
        answer = work(task, report)
    except KeyboardInterrupt:
        return
    connection.send(_Done(answer))
