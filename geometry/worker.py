"""CAD and meshing in a child process, so that a hang or a crash can be ended and reported in one line."""

import atexit
import os
import resource
import tempfile
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from pinnray.runtime.errors import UserError
from pinnray.runtime.machine import free_memory_gb, limit_memory, peak_memory_gb
from pinnray.runtime.processes import Pool, ProcessFailed


def run_task(task: Mapping[str, Any], timeout_s: float) -> Any:
    """Run a task in this process's worker, wait for it and return its result.

    Args:
        task: `kind`, and `what` as its description in messages; for a "mesh" also `finger` as its definition,
            `settings` as a dictionary and perhaps `across`, for "cad" `finger` and `formats`, for a "drawing"
            its `file` and `description`.
        timeout_s: Time limit, s.
    """
    what, memory_gb = str(task["what"]), 0.9 * free_memory_gb()
    limited, peaks = {what: {**task, "memory_gb": memory_gb}}, [0.0]
    ((_, answer),) = _pool(os.getpid()).answers(
        perform, limited, timeout_s=timeout_s, report=lambda _, peak_gb: peaks.append(peak_gb)
    )
    if isinstance(answer, UserError):
        raise answer
    if not isinstance(answer, ProcessFailed):
        return answer
    if answer.exit_code is None:
        raise UserError(f"{what} was ended after {timeout_s:g} s; use larger elements, or allow more time")
    # Gmsh crashes where it gets no more. An earlier task may have taken as much.
    crowded = answer.exit_code < 0 and answer.peak_gb > max(0.8 * memory_gb, *peaks)
    last_words = ("bad_alloc", "MemoryError", "Cannot allocate memory", "out of memory")
    if crowded or any(words in answer.reason for words in last_words):
        raise _too_large(what, memory_gb)
    raise UserError(f"{what} failed (exit code {answer.exit_code}): {answer.reason}")


@cache
def _pool(parent: int) -> Pool:
    """The worker of the process with this number; a forked process gets its own."""
    pool = Pool(1, captured=True)
    atexit.register(pool.stop)
    return pool


def perform(task: Mapping[str, Any], report: Callable[..., None]) -> Any:
    """Run a task in this process: its result, or why there is none; report the memory that it had before."""
    try:
        work = _work(str(task["kind"]))
        limit_memory(task["memory_gb"])
        report(peak_memory_gb(resource.getrusage(resource.RUSAGE_SELF)))
        return work(task)
    except MemoryError:
        return _too_large(task["what"], task["memory_gb"])
    except UserError as error:
        return UserError(str(error))
    except OSError as error:
        place = error.filename or tempfile.gettempdir()
        return UserError(f"{task['what']} failed: {place}: {error.strerror or error}")


def _work(kind: str) -> Callable[[Mapping[str, Any]], Any]:
    """The function for tasks of a kind, its libraries imported: a limit of memory is the task's alone."""
    if kind == "drawing":
        from pinnray.geometry.drawing.description import Description
        from pinnray.geometry.drawing.load import finger_from_file

        return lambda task: finger_from_file(task["file"], Description(**task["description"]))
    from pinnray.geometry.drawing.drawn_finger import finger_from

    if kind == "mesh":
        from pinnray.geometry.mesh.mesher import MIN_ELEMENTS, build_mesh
        from pinnray.geometry.mesh.settings import MeshSettings

        return lambda task: build_mesh(
            finger_from(task["finger"]), MeshSettings(**task["settings"]), task.get("across", MIN_ELEMENTS)
        )
    from pinnray.geometry.cad import cad_contents

    return lambda task: cad_contents(finger_from(task["finger"]), task["formats"])


def _too_large(what: str, memory_gb: float) -> UserError:
    return UserError(f"{what} needs more than {memory_gb:.2g} GB, which is what is free; use larger elements")
