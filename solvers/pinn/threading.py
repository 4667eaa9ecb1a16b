"""Evaluate many points in pieces that stay in a core's cache, one piece a thread.

Elementwise operations on large arrays are bound by memory, and torch's own threads meet at a barrier after
each of them; with pieces there is one barrier in all. On two busy cores this was measured to be three to
eight times as fast.
"""

import ctypes
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from typing import TypeVar

import torch
from threadpoolctl import threadpool_limits

PIECE = 2**14
"""Numbers in one array of a piece: an eighth of a megabyte."""

_POOL: ContextVar[ThreadPoolExecutor | None] = ContextVar("_POOL", default=None)

Item = TypeVar("Item")
Result = TypeVar("Result")


def in_pieces(task: Callable[[slice], None], points: int, units: int) -> None:
    """Call `task` with slices that cut `points` rows of `units` numbers into pieces, on every thread."""
    in_threads(task, cut(points, max(PIECE // units, 8)))


def cut(points: int, size: int) -> list[slice]:
    """Slices that cut `points` rows into pieces of at most `size`."""
    return [slice(start, min(start + size, points)) for start in range(0, points, size)]


def in_threads(task: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """`task` of every item, in the items' order, on every thread."""
    with pool() as threads:
        return list(threads.map(task, items))


def one_by_one(task: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """The same, each result given up as soon as the next one is asked for."""
    with pool() as threads:
        yield from threads.map(task, items)


@contextmanager
def pool() -> Iterator[ThreadPoolExecutor]:
    """A thread for each that torch may use; the threads of torch and of its BLAS rest meanwhile.

    Within it the functions of this module use it, and what lies between them has one thread: on busy cores
    torch's own threads wait for one another after every small operation, which was measured to cost more
    than half of the time. With DOLFINx in the process torch's matrix products may be OpenBLAS's, which has
    threads of its own and lets callers wait for one another: three times as slow, when measured.
    """
    outer = _POOL.get()
    if outer is not None:
        yield outer
        return
    _keep_freed_memory()
    threads = torch.get_num_threads()
    with (
        torch_threads(1),
        threadpool_limits(1, user_api="blas"),
        ThreadPoolExecutor(threads, initializer=torch.set_num_threads, initargs=(1,)) as made,
    ):
        token = _POOL.set(made)
        try:
            yield made
        finally:
            _POOL.reset(token)


@cache
def _keep_freed_memory() -> None:
    """Have glibc keep what a piece frees for the next one.

    By default it returns blocks above 128 kB to the kernel at once; getting them again by page faults was
    measured to take a quarter of the time.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        trim_threshold, mmap_threshold, size = -1, -3, 2**25
        mallopt(trim_threshold, 8 * size)
        mallopt(mmap_threshold, size)


@contextmanager
def torch_threads(count: int) -> Iterator[int]:
    """Let torch use `count` threads, or as many as it is set to if that is 0; yields how many those are."""
    before = torch.get_num_threads()
    torch.set_num_threads(count or before)
    try:
        yield count or before
    finally:
        torch.set_num_threads(before)
