"""A pool of supervised child processes, for work that may hang, crash or run beside other work.

A child runs one function of a module after another and stays for the next, because its imports take longer
than a mesh. It does not run the calling script once more.

Not `pebble.ProcessPool`: when the program is killed its workers go on until their task is done, when it is
interrupted they are killed before they can save their state, and they cannot report progress.
"""

import os
import pickle
import shutil
import signal
import subprocess
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Callable, Generator, Hashable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from functools import partial
from importlib import import_module
from importlib.machinery import PathFinder
from math import inf
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from pathlib import Path
from time import monotonic
from typing import IO, Any, Self, TypeVar

from pinnray.runtime.processes.child import ProcessFailed, serve

FOREIGN_PREFIXES = ("OMPI_", "PMIX_", "PMI_", "PRTE_", "I_MPI_", "MPI_", "HYDRA_", "MPIEXEC_")
"""Environment variables that would make a child a member of the parent's MPI run."""

PATIENCE_S = 1.0
"""Time that an interrupted task has for its next report, s; then it is interrupted wherever it is."""

Name = TypeVar("Name", bound=Hashable)
Input = TypeVar("Input")
Output = TypeVar("Output")


class Pool:
    """Child processes that run tasks, one at a time each; a context manager that ends them.

    They are started when they are needed and end with this process, however it ends. Python imports nothing
    from the working folder there, where files of others may lie. Their temporary files are removed.

    Args:
        count: Largest number of processes at a time.
        threads: Threads of the linear algebra in each, unless `OMP_NUM_THREADS` is set: threads that wait for
            one another on cores of others take more than they give.
        captured: Whether an interrupted process is killed at once, as it has no state to save, and what it
            writes is kept for `ProcessFailed.reason`.
        modules: What each process imports as it starts, where it is installed.
    """

    def __init__(
        self, count: int, *, threads: int = 1, captured: bool = False, modules: Sequence[str] = ()
    ) -> None:
        self._count, self._captured = count, captured
        self._child = partial(_Child, threads, captured, modules)
        self._idle: list[_Child] = []
        self._abandoned, self._abandon = Pipe(duplex=False)  # A message ends all tasks
        with suppress(ValueError):  # outside of the main thread, where it cannot be set
            signal.signal(signal.SIGPIPE, signal.SIG_IGN)  # as Python does

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def answers(
        self,
        work: Callable[[Input, Callable[..., None]], Output],
        tasks: Mapping[Name, Input],
        *,
        report: Callable[..., None] = lambda *_: None,
        timeout_s: float = inf,
        deaths: int = 1,
    ) -> Generator[tuple[Name, Output | ProcessFailed], None, None]:
        """Run tasks and yield their answers as they come.

        When the iterator is closed or interrupted, or this process is killed, the next progress report of
        every running task raises KeyboardInterrupt there, so that it can save its state. One that reports
        nothing is interrupted as by SIGINT.

        Warnings in a process are warnings here, where Python shows a text only once.

        Args:
            work: A function of a module, called with a task and a function that reports progress.
            tasks: Tasks by name; they must be picklable.
            report: Called with the task's name and what it reports.
            timeout_s: Time limit of each task, s.
            deaths: Processes that a task may end before it counts as failed.
        """
        waiting, died = dict(tasks), Counter[Name]()
        running: dict[Connection, tuple[Name, _Child, float]] = {}
        try:
            while waiting or running:
                while waiting and len(running) < self._count:
                    name = next(iter(waiting))
                    child = self._idle.pop() if self._idle else self._child()
                    running[child.connection] = name, child, monotonic() + timeout_s
                    child.send((pickle.dumps((work, waiting.pop(name))), timeout_s))
                left = min(end for *_, end in running.values()) - monotonic()
                ready = wait([*running, self._abandoned], None if left == inf else max(left, 0.0))
                if self._abandoned in ready:
                    return
                for connection in [each for each in running if each in ready]:
                    name, child, _ = running[connection]
                    kind, content = child.message()
                    if kind == "warning":
                        warnings.warn(content, RuntimeWarning, stacklevel=2)
                    elif kind == "report":
                        report(name, *content)
                    else:
                        del running[connection]
                        if kind == "answer":
                            self._idle.append(child)
                        else:
                            died[name] += 1
                        if kind == "death" and died[name] < deaths:
                            waiting[name] = tasks[name]
                        else:
                            yield name, content
                for connection, (name, child, end) in list(running.items()):
                    if end <= monotonic():
                        del running[connection]
                        child.end(kill=True)
                        yield name, ProcessFailed(None)
        finally:
            _end(child for _, child, _ in running.values())

    @contextmanager
    def beside(
        self,
        work: Callable[[Input, Callable[..., None]], Output],
        task: Input,
        *,
        report: Callable[..., None] = lambda *_: None,
    ) -> Iterator[Future[Output | ProcessFailed]]:
        """Run one task while the block runs, and yield its answer to come; a block that raises ends it.

        Args:
            work: See `answers`.
            task: See `answers`.
            report: Called in another thread with what the task reports.
        """

        def answer() -> Output | ProcessFailed:
            for _, found in self.answers(work, {"": task}, report=lambda _, *said: report(*said)):
                return found
            return ProcessFailed(None)  # Abandoned: nobody asks any more

        self.start()  # here: the system takes the end of a thread for that of its processes' parent
        with ThreadPoolExecutor(1) as thread:
            try:
                yield thread.submit(answer)
            except BaseException:
                self._abandon.send(None)
                raise

    def start(self) -> None:
        """Start a process, unless one waits for work."""
        if not self._idle:
            self._idle.append(self._child())

    def stop(self) -> None:
        """End the processes that wait for work."""
        _end(self._idle)
        self._idle.clear()


class _Child:
    """A process, its connection, its folder of temporary files, and what it wrote if that is captured."""

    def __init__(self, threads: int, captured: bool, modules: Sequence[str]) -> None:
        self.connection, theirs = Pipe()
        self._folder = tempfile.mkdtemp(prefix="pinnray-")
        self._written: IO[str] | None = (
            tempfile.TemporaryFile("w+", errors="replace") if captured else None  # noqa: SIM115
        )
        environment = child_environment(os.environ) | {"PYTHONSAFEPATH": "1", "TMPDIR": self._folder}
        environment.setdefault("OMP_NUM_THREADS", str(threads))  # torch and OpenBLAS read it when loaded
        patience = 0.0 if captured else PATIENCE_S
        self.process = subprocess.Popen(
            [sys.executable, "-c", _CHILD, str(theirs.fileno()), str(patience)],
            stdin=subprocess.DEVNULL,
            stderr=self._written,
            env=environment,
            pass_fds=[theirs.fileno()],
        )
        theirs.close()
        self.send((sys.path, modules))
        self._unused = True

    def send(self, content: object) -> None:
        """Send the search path and the modules to import, and later the tasks."""
        self._unused = False
        with suppress(OSError):  # it has ended already, which its next message tells
            self.connection.send(content)

    def message(self) -> tuple[str, Any]:
        """The next message: a report, a warning, the answer, or the death of the process."""
        try:
            kind, content = self.connection.recv()
            return kind, content
        except (EOFError, OSError):
            code, reason = self.process.wait(), ""
            if self._written:
                self._written.seek(0)
                reason = (self._written.read().strip().splitlines() or ["it left no message"])[-1]
            self.end()
            return "death", ProcessFailed(code, reason)

    def close(self) -> None:
        """Let a process end, and one with a task after it has saved its state; an unused one may import."""
        self.connection.close()
        if self._written or self._unused:
            self.process.kill()

    def end(self, *, kill: bool = False) -> None:
        """Wait for the end of the process and remove its files."""
        if kill:
            self.process.kill()
        self.connection.close()
        self.process.wait()
        if self._written:
            self._written.close()
        shutil.rmtree(self._folder, ignore_errors=True)


_CHILD = f"from {serve.__module__} import serve; serve()"


def _end(children: Iterable[_Child]) -> None:
    """End processes, all of them at the same time."""
    ending = list(children)
    for child in ending:
        child.close()
    for child in ending:
        child.end()


def known_to_children(value: object) -> bool:
    """Whether a process of a `Pool` can be given a value, and can import its class.

    It does not run the calling script, and imports nothing from the working folder.
    """
    module, places = type(value).__module__, [place for place in sys.path if place]
    if module == "__main__" or PathFinder.find_spec(module.partition(".")[0], places) is None:
        return False
    try:
        pickle.dumps(value)
    except (pickle.PicklingError, AttributeError, TypeError):  # such as the class of a function
        return False
    return True


def child_environment(environment: Mapping[str, str]) -> dict[str, str]:
    """The environment without MPI's variables and with the folder of this program's package on the path."""
    kept = {name: value for name, value in environment.items() if not name.startswith(FOREIGN_PREFIXES)}
    package = import_module(__name__.partition(".")[0])
    root = str(Path(str(package.__file__)).resolve().parent.parent)
    kept["PYTHONPATH"] = os.pathsep.join(filter(None, [root, kept.get("PYTHONPATH", "")]))
    return kept
