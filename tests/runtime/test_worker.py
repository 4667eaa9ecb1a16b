"""Tasks in the worker: refusals, crashes and lack of memory, each in one line."""

import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest

from pinnray.runtime.errors import UserError
from pinnray.runtime.processes.pool import Pool
from pinnray.runtime.processes.worker import ChildCall, perform, run_task

limited = pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="memory is limited on Linux only")


def refusing() -> Callable[[], None]:
    def work() -> None:
        raise UserError("ribs overlap")

    return work


def broken() -> Callable[[], None]:
    def work() -> None:
        raise TypeError("a fault of our own")

    return work


def filling() -> Callable[[int], int]:
    return lambda size: len(bytearray(size))


def crashing() -> Callable[[], None]:
    return lambda: os.kill(os.getpid(), signal.SIGSEGV)


@pytest.mark.parametrize(
    ("prepare", "line"),
    [
        (refusing, "ribs overlap"),
        (broken, r"meshing failed \(exit code 1\): TypeError: a fault of our own"),
        (crashing, r"meshing failed \(exit code -11\): it left no message; it may need more than .* GB, .*"),
    ],
)
def test_a_task_without_a_result_is_one_line(prepare, line) -> None:
    with pytest.raises(UserError, match=rf"^{line}$"):
        run_task(ChildCall("meshing", prepare, ()), 60)


@limited
def test_a_task_that_needs_more_memory_than_is_free_is_one_line() -> None:
    """A task that takes a gigabyte, then one that takes a megabyte, with 0.5 GB free."""
    sizes = {"large": 10**9, "small": 10**6}
    tasks = {name: (ChildCall(name, filling, (size,)), 0.5) for name, size in sizes.items()}
    with Pool(1) as pool:
        answers = dict(pool.answers(perform, tasks))
    assert str(answers["large"]) == "large needs more than 0.5 GB, which is what is free; use larger elements"
    assert answers["small"] == 10**6
