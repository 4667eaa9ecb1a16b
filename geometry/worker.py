"""The child process for CAD and meshing, so that a hang or a crash can be ended and reported.

`python -m geometry.worker` reads tasks as lines of JSON from standard input and answers each with one. It
stays for the next task, because starting it takes longer than a mesh.
"""

import atexit
import json
import os
import resource
import selectors
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from queue import SimpleQueue
from typing import IO, Any

from geometry.errors import UserError
from geometry.machine_memory import free_memory_gb, limit_memory

FOREIGN_PREFIXES = ("OMPI_", "PMIX_", "PMI_", "PRTE_", "I_MPI_", "MPI_", "HYDRA_", "MPIEXEC_")
"""Environment variables that would make the child a member of the parent's MPI run."""

SAFE_PATH = {"PYTHONSAFEPATH": "1"}
"""Environment in which Python imports nothing from the working folder, where files of others may lie."""

EXTRA_SECONDS = 5
USABLE = 0.9
"""Share of the free memory that a task may take."""
TOO_LARGE = "{what} needs more than {memory_gb:.2g} GB, which is what is free; use larger elements"
OUT_OF_MEMORY = ("bad_alloc", "MemoryError", "Cannot allocate memory", "out of memory")
"""Last words of a process that got no memory."""
NEARLY = 0.8
"""Share of its memory from which on a task that a signal ends has run out of it: Gmsh then crashes."""


def run_task(task: Mapping[str, Any], timeout_s: float) -> Path:
    """Run a task in this process's worker and wait for it.

    Args:
        task: Argument of `perform`, with `what` as its description in messages.
        timeout_s: Time limit, s.

    Returns:
        The file with the result, in a temporary folder of the worker; remove it when it is read.

    Raises:
        UserError: One line, if the task fails or takes too long.
    """
    worker = _worker(os.getpid())
    output = worker.folder / str(task["output"])
    try:
        limits = {"timeout_s": timeout_s, "memory_gb": USABLE * free_memory_gb()}
        error = worker.answer({**task, "output": str(output), **limits}, timeout_s)
    except BaseException:  # a time-out, a crash, or Ctrl-C: leave no process behind
        worker.stop()
        _worker.cache_clear()
        raise
    if error:
        raise UserError(error)
    return output


class Worker:
    """A child process that runs tasks one after another.

    Attributes:
        folder: Folder of its results and temporary files, which ends with it.
    """

    def __init__(self) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="pinnray-"))
        self._errors: IO[str] = tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace")  # noqa: SIM115
        self._process = subprocess.Popen(
            [sys.executable, "-m", "geometry.worker", str(self.folder)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            text=True,
            env=child_environment(os.environ) | SAFE_PATH | {"TMPDIR": str(self.folder)},
        )

    def answer(self, task: Mapping[str, Any], timeout_s: float) -> str:
        """Run a task: empty if it was done, else the reason why it was refused.

        Raises:
            UserError: If it takes too long or the process ends.
        """
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            self._process.stdin.write(json.dumps(task) + "\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            raise self._ended(task) from None
        with selectors.DefaultSelector() as ready:
            ready.register(self._process.stdout, selectors.EVENT_READ)
            if not ready.select(timeout_s):
                raise UserError(
                    f"{task['what']} was ended after {timeout_s:g} s; use larger elements, or allow more time"
                )
        if not (line := self._process.stdout.readline()):
            raise self._ended(task)
        return str(json.loads(line)["error"])

    def stop(self) -> None:
        """End the process, whatever it does."""
        atexit.unregister(self.stop)
        self._process.kill()
        self._process.communicate()
        self._errors.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def _ended(self, task: Mapping[str, Any]) -> UserError:
        code = self._process.wait()
        self._errors.seek(0)
        last = self._errors.read().strip().splitlines()[-1:] or ["it left no message"]
        most_gb = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024 / 1e9
        crowded = code < 0 and most_gb > NEARLY * task.get("memory_gb", float("inf"))
        if crowded or any(word in last[0] for word in OUT_OF_MEMORY):
            return UserError(TOO_LARGE.format(**{"memory_gb": most_gb, **task}))
        return UserError(f"{task['what']} failed (exit code {code}): {last[0]}")


@cache
def _worker(parent: int) -> Worker:
    """The worker of the process with this number; a forked process gets its own."""
    worker = Worker()
    atexit.register(worker.stop)
    return worker


def child_environment(environment: Mapping[str, str]) -> dict[str, str]:
    """The environment without MPI's variables and with this package on the path."""
    kept = {name: value for name, value in environment.items() if not name.startswith(FOREIGN_PREFIXES)}
    root = str(Path(__file__).resolve().parent.parent)
    kept["PYTHONPATH"] = os.pathsep.join(filter(None, [root, kept.get("PYTHONPATH", "")]))
    return kept


def perform(task: Mapping[str, Any]) -> None:
    """Run a task in this process.

    Args:
        task: `kind` and `output` as the path of the result; for a "mesh" also `finger` as its definition and
            `settings` as a dictionary, for "cad" `finger` and `formats`, for a "drawing" its `file` and
            `description`. `memory_gb`, if it is there, is the memory that the task may take, GB.
    """
    work = _work(str(task["kind"]))
    if "memory_gb" in task:
        limit_memory(task["memory_gb"])
    work(task, Path(task["output"]))


def _work(kind: str) -> Callable[[Mapping[str, Any], Path], None]:
    """The function for tasks of a kind, its libraries imported: a limit of memory is the task's alone."""
    if kind == "drawing":
        from geometry.drawing.description import Description
        from geometry.drawing.load import load_drawing

        return lambda task, output: load_drawing(task["file"], Description(**task["description"])).save(
            output
        )
    from geometry.drawing.definition import finger_from

    if kind == "mesh":
        from geometry.mesh.mesher import build_mesh
        from geometry.mesh.settings import MeshSettings

        return lambda task, output: build_mesh(
            finger_from(task["finger"]), MeshSettings(**task["settings"])
        ).save(output)
    if kind == "cad":
        from geometry.cad import write_archive

        return lambda task, output: write_archive(finger_from(task["finger"]), task["formats"], output)
    raise UserError(f"unknown task {kind!r}; there are 'mesh', 'cad' and 'drawing'")


def main() -> None:
    """Read tasks, run them, and answer, until the parent ends, however it does.

    Libraries print to the standard output too, such as OpenCASCADE about a STEP file that was cut off: that
    goes to the standard error, so that the answers are alone.
    """
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    tasks: SimpleQueue[dict[str, Any]] = SimpleQueue()
    threading.Thread(target=_listen, args=(tasks,), daemon=True).start()
    while True:
        task = tasks.get()
        if hasattr(signal, "alarm"):  # ends this process if the parent was killed and a library hangs
            signal.alarm(int(task["timeout_s"]) + EXTRA_SECONDS)
        try:
            perform(task)
            error = ""
        except MemoryError:
            error = TOO_LARGE.format(**task)
        except UserError as refusal:
            error = str(refusal)
        except OSError as fault:
            place = fault.filename or sys.argv[1]
            error = f"{task['what']} failed: {place}: {fault.strerror or fault}"
        if hasattr(signal, "alarm"):
            signal.alarm(0)
        print(json.dumps({"error": error}), file=answers, flush=True)


def _listen(tasks: SimpleQueue[dict[str, Any]]) -> None:
    """Pass the tasks on; when the parent has ended, end this process and remove its folder."""
    for line in sys.stdin:
        tasks.put(json.loads(line))
    shutil.rmtree(sys.argv[1], ignore_errors=True)
    os._exit(0)


if __name__ == "__main__":
    main()
