"""A task in a child process with a limit of time and memory: a hang or a crash ends in one line."""

import atexit
import os
import tempfile
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

from pinnray.runtime.errors import UserError
from pinnray.runtime.machine import free_memory_gb, limit_memory
from pinnray.runtime.processes.child import ProcessFailed
from pinnray.runtime.processes.pool import Pool


class ChildCall(NamedTuple):
    """A call of a function in the child process; it must be picklable.

    Attributes:
        what: Its description in messages, such as "meshing design 'default'".
        prepare: A function of a module that imports its libraries, which the limit of memory leaves out, and
            returns the function to call.
        given: What that function is called with.
    """

    what: str
    prepare: Callable[[], Callable[..., Any]]
    given: tuple[object, ...]


def run_task(task: ChildCall, timeout_s: float) -> Any:
    """Run a task in this process's worker, wait for it and return its result.

    Raises:
        UserError: If it raises one, takes longer than `timeout_s`, s, or more memory than is free, or if its
            process crashes.
    """
    what, memory_gb = task.what, 0.9 * free_memory_gb()
    pool = _pool(os.getpid())
    ((_, answer),) = pool.answers(perform, {what: (task, memory_gb)}, timeout_s=timeout_s)
    if isinstance(answer, UserError):
        raise answer
    if not isinstance(answer, ProcessFailed):
        return answer
    if answer.exit_code is None:
        raise UserError(f"{what} was ended after {timeout_s:g} s; use larger elements, or allow more time")
    last_words = ("bad_alloc", "MemoryError", "Cannot allocate memory", "out of memory")
    if any(words in answer.reason for words in last_words):
        raise _too_large(what, memory_gb)
    # Gmsh crashes where it gets no more memory.
    crash = f"; it may need more than {memory_gb:.2g} GB, which is what is free" * (answer.exit_code < 0)
    raise UserError(f"{what} failed (exit code {answer.exit_code}): {answer.reason}{crash}")


@cache
def _pool(parent: int) -> Pool:
    """The worker of the process with this number; a forked process gets its own."""
    pool = Pool(1, captured=True)
    atexit.register(pool.stop)
    return pool


def perform(limited: tuple[ChildCall, float], _: object) -> Any:
    """Run a task with a limit of memory, GB, in this process.

    Returns:
        Its result, or why there is none.
    """
    task, memory_gb = limited
    try:
        work = task.prepare()
        limit_memory(memory_gb)
        return work(*task.given)
    except MemoryError:
        return _too_large(task.what, memory_gb)
    except UserError as error:
        return UserError(str(error))
    except OSError as error:
        place = error.filename or tempfile.gettempdir()
        return UserError(f"{task.what} failed: {place}: {error.strerror or error}")


def _too_large(what: str, memory_gb: float) -> UserError:
    return UserError(f"{what} needs more than {memory_gb:.2g} GB, which is what is free; use larger elements")
