"""Evaluates many points in chunks, or patches of neighbours, that stay in a core's cache, one a thread.

Elementwise operations on large arrays are bound by memory, and torch's own threads meet at a barrier after
each of them; chunks need one barrier in all. On two busy cores this was measured to be three to eight times
as fast. The basis functions that reach one patch are a small dense block, for which dense matrix kernels are
faster than a sparse matrix of all points and basis functions.
"""

import ctypes
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from functools import cache
from typing import Any, TypeVar

import numpy as np
import torch
from scipy.spatial import cKDTree
from threadpoolctl import threadpool_limits

from pinnray.runtime.arrays import FloatArray, IntArray

CHUNK = 2**14
"""Numbers in one array of a chunk: an eighth of a megabyte."""

_POOL: ContextVar[Callable[..., Iterator[Any]] | None] = ContextVar("_POOL", default=None)

Item = TypeVar("Item")
Result = TypeVar("Result")


def slices(points: int, size: int) -> list[slice]:
    """Slices of at most `size` rows that partition `points` rows; one empty slice for none."""
    return [slice(start, min(start + size, points)) for start in range(0, max(points, 1), size)]


def imap_in_threads(task: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """`task` of every item, in order, on every thread; each is released when the next one is asked for."""
    with pool() as mapped:
        yield from mapped(task, items)


@contextmanager
def pool() -> Iterator[Callable[..., Iterator[Any]]]:
    """The `map` of as many threads as torch may use; torch and its BLAS have one thread each meanwhile.

    The functions of this module use the pool that they are called in. One thread is the calling one: another
    would take 50 microseconds more for every item. On busy cores torch's own threads wait
    for one another after every small operation, which was measured to cost more than half of the time. With
    DOLFINx in the process torch's matrix products may be OpenBLAS's, whose threads let callers wait for one
    another: measured three times as slow.
    """
    outer = _POOL.get()
    if outer is not None:
        yield outer
        return
    _keep_freed_memory()
    threads = torch.get_num_threads()
    with threadpool_limits(1, user_api="blas"), ExitStack() as stack:
        stack.callback(torch.set_num_threads, threads)
        torch.set_num_threads(1)
        made: Callable[..., Iterator[Any]] = map
        if threads > 1:
            executor = ThreadPoolExecutor(threads, initializer=torch.set_num_threads, initargs=(1,))
            made = stack.enter_context(executor).map
        token = _POOL.set(made)
        try:
            yield made
        finally:
            _POOL.reset(token)


@cache
def _keep_freed_memory() -> None:
    """Make glibc keep freed memory for the next chunk.

    By default it returns blocks above 128 kB to the kernel at once; the page faults of getting them back were
    measured to take a quarter of the time.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        trim_threshold, mmap_threshold, size = -1, -3, 2**25
        mallopt(trim_threshold, 8 * size)
        mallopt(mmap_threshold, size)


PATCH = 192
"""Points in a patch: with fewer, a window is in more patches; with more, it is far from some points."""

SUMMED = 448
"""Points in a patch of a sum over the windows, where a far window costs less: 0.7 of the time by `PATCH`."""

MANY, MOST = 1000, 1024
"""Number of patches above which they grow, and the most points in one."""


def cut_into_patches(points: FloatArray, most: int = PATCH) -> list[IntArray]:
    """Numbers of the points (n, 2) in each patch, `most` at most; every point is in one patch.

    Very many points are so dense that larger patches, which cost less a point, are still small.
    """
    if not len(points):
        return []
    size = min(max(most, len(points) // MANY), MOST)
    found, todo = [], [cKDTree(points, leafsize=size, balanced_tree=False, compact_nodes=False).tree]
    while todo:
        node: Any = todo.pop()
        if node.lesser is None:
            found.append(node.indices.copy())
        else:
            todo += [node.greater, node.lesser]
    return found


def boxes_around(patches: Sequence[torch.Tensor]) -> torch.Tensor:
    """Lower left and upper right corners of the boxes around patches of points (n, 2), shape (b, 2, 2)."""
    starts = np.cumsum([0, *(len(patch) for patch in patches[:-1])])
    points = np.concatenate([patch.numpy() for patch in patches])
    ends = [extreme.reduceat(points, starts) for extreme in (np.minimum, np.maximum)]
    return torch.from_numpy(np.stack(ends, axis=1))
