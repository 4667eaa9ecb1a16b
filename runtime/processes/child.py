"""The child's side of a pool: runs tasks until its parent closes the connection or ends."""

import gc
import logging
import os
import pickle
import shutil
import signal
import sys
import warnings
from contextlib import suppress
from ctypes import CDLL
from dataclasses import dataclass
from importlib import import_module
from math import inf
from multiprocessing.connection import Connection
from queue import SimpleQueue
from threading import Event, Thread


@dataclass(frozen=True)
class ProcessFailed:
    """A task without an answer; its traceback, if it had one, is on standard error."""

    exit_code: int | None  # of its process, negative for the signal that ended it; None after the time limit
    reason: str = ""  # last line of a `captured` process, or a file that could not be read or written

    @property
    def message(self) -> str:
        """The end of the process, as a clause."""
        return self.reason or f"its process ended with exit code {self.exit_code}"


def end_with_parent() -> None:
    """Let the system kill this process when its parent ends, which it would notice at its next report.

    For a task that writes where the next run of its parent will. Elsewhere than on Linux this does nothing.
    """
    if sys.platform == "linux":
        pr_set_pdeathsig = 1  # prctl(2)
        CDLL(None).prctl(pr_set_pdeathsig, signal.SIGKILL)


def serve() -> None:
    """Run tasks until the parent closes the connection or ends, however it does.

    Signals of the terminal reach this process through its parent. Libraries print to the standard output,
    such as OpenCASCADE about a STEP file that was cut off: that goes to the standard error.
    """
    connection, patience_s = Connection(int(sys.argv[1])), float(sys.argv[2])
    os.dup2(2, 1)
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.default_int_handler)

    def report(*message: object) -> None:
        try:
            connection.send(("report", message))
        except OSError:  # nobody listens any more
            ending.set()
            raise KeyboardInterrupt from None

    def warn(message: Warning | str, *_: object, **__: object) -> None:
        with suppress(OSError):
            connection.send(("warning", str(message)))

    logging.captureWarnings(True)  # FFCx does when it is imported, which would undo the next line
    warnings.showwarning = warn
    ending = Event()
    tasks: SimpleQueue[tuple[bytes, float] | None] = SimpleQueue()
    try:
        places, modules = connection.recv()
        sys.path += [place for place in places if place and place not in sys.path]
        Thread(target=_listen, args=(connection, tasks, ending, patience_s), daemon=True).start()
        for module in modules:
            with suppress(Exception):  # what is missing or broken is told by the task that needs it
                import_module(module)
        while (message := tasks.get()) is not None:
            content, timeout_s = message
            if timeout_s < inf:  # ends this process if the parent was killed and a library hangs
                signal.alarm(int(timeout_s) + 5)
            try:
                work, task = pickle.loads(content)
                answer = work(task, report)
            except OSError as error:  # such as a full disk: no fault of the program
                place = error.filename or "input or output"
                answer = ProcessFailed(1, f"{place}: {error.strerror or error}")
            signal.alarm(0)
            connection.send(("answer", answer))
    except (KeyboardInterrupt, EOFError, BrokenPipeError):  # nobody asks any more
        pass
    finally:
        ending.set()
        shutil.rmtree(os.environ["TMPDIR"], ignore_errors=True)
        gc.freeze()  # the parent waits for the end, which would take a second to look for garbage


def _listen(
    connection: Connection, tasks: "SimpleQueue[tuple[bytes, float] | None]", ending: Event, patience_s: float
) -> None:
    """Pass the tasks on; when the parent has closed the connection or ended, end this process."""
    with suppress(EOFError, OSError):
        while True:
            tasks.put(connection.recv())
    tasks.put(None)
    if not patience_s:
        shutil.rmtree(os.environ["TMPDIR"], ignore_errors=True)
        os._exit(0)
    if not ending.wait(patience_s):
        os.kill(os.getpid(), signal.SIGTERM)
