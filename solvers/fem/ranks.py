"""MPI ranks that serve a command: rank 0 runs it, the others only take part in its solves.

Without a `RankPool` every rank runs the whole program, and its finite-element spaces are distributed over all
ranks. With one (`mpirun -n 2 compare ...`) a space is rank 0's own, but for those made `on_all_ranks`.
"""

import math
import os
import signal
import sys
import time
import traceback
from collections.abc import Callable
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, TypeVar

from mpi4py import MPI

import pinnray.solvers.petsc  # noqa: F401 (on all ranks together: one alone would wait for the others when it solves)
from pinnray.runtime.processes.pool import child_environment
from pinnray.solvers.problem import Problem
from pinnray.solvers.solver import Progress, silent

TASK, DISMISSAL = 1, 2
"""Tags of messages from rank 0: a task with its problem, the exit code of the command."""

PATIENCE_S = 5.0
"""Time that a rank on which a task failed waits for the others before it ends them."""

POLL_S = 0.005
"""Time between two looks of an idle rank at its messages; MPI itself would keep a core busy."""

TaskResult = TypeVar("TaskResult")

CollectiveTask = Callable[[Problem, Progress], TaskResult]
"""A collective task: a method of an object that can be pickled, or a function of a module."""


def communicator() -> MPI.Comm:
    """The ranks that share a new finite-element space: all, or this one alone if the pool is idle."""
    pool = _pool.get()
    return MPI.COMM_WORLD if pool is None or pool.busy else MPI.COMM_SELF


def on_all_ranks(task: CollectiveTask[TaskResult], problem: Problem, progress: Progress) -> TaskResult:
    """Do a task; rank 0 of a pool has the others do it too. The progress is called on this rank."""
    pool = _pool.get()
    if pool is None or pool.busy:
        return task(problem, progress)
    return pool.call(task, problem, progress)


def lead(command: Callable[[], Any], guarded: Callable[[Callable[[], Any]], int]) -> int:
    """Run a command on rank 0 of several, served by the others; the exit code is the same on all of them.

    `guarded` runs the command, reports errors and returns the exit code.
    """
    pool = RankPool(MPI.COMM_WORLD.Dup())
    # What this process starts from now on must not take itself for a rank of this run.
    for name in set(os.environ) - set(child_environment(os.environ)):
        del os.environ[name]
    leads = pool.comm.rank == 0
    # After Ctrl-C the launcher sends SIGTERM to all: rank 0 ends as if it were interrupted itself.
    signal.signal(signal.SIGTERM, signal.default_int_handler if leads else signal.SIG_DFL)
    if not leads:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    token = _pool.set(pool)
    try:
        code = guarded(command if leads else pool.serve)
    except Exception:
        traceback.print_exc()
        code = 1
    finally:
        _pool.reset(token)
    sys.stdout.flush()
    sys.stderr.flush()
    if pool.broken:
        MPI.COMM_WORLD.Abort(code)
    if leads:
        for rank in range(1, pool.comm.size):
            pool.comm.send(code, dest=rank, tag=DISMISSAL)
    return code


@dataclass
class RankPool:
    """The ranks that serve a command."""

    comm: MPI.Comm  # For messages between them
    busy: bool = False  # Whether this rank is in a collective task
    broken: bool = False  # Whether another rank may be waiting for this one in a task that this one has left

    def call(self, task: CollectiveTask[TaskResult], problem: Problem, progress: Progress) -> TaskResult:
        """Do a task on all ranks, of which this is rank 0."""
        for rank in range(1, self.comm.size):
            self.comm.send((task, problem), dest=rank, tag=TASK)
        return self._do(task, problem, progress)

    def serve(self) -> int:
        """Do the tasks that rank 0 sends, until it sends the exit code; raise if one fails here alone."""
        status = MPI.Status()
        while True:
            while not self.comm.Iprobe(source=0):
                time.sleep(POLL_S)
            message = self.comm.recv(source=0, status=status)
            if status.tag == DISMISSAL:
                return int(message)
            task, problem = message
            try:
                self._do(task, problem, silent)
            except Exception:
                if self.broken:
                    raise

    def _do(self, task: CollectiveTask[TaskResult], problem: Problem, progress: Progress) -> TaskResult:
        self.broken = self.busy = True
        try:
            answer = task(problem, progress)
        except Exception:
            self._meet(PATIENCE_S)
            raise
        finally:
            self.busy = False
        self._meet(math.inf)
        return answer

    def _meet(self, patience: float) -> None:
        """Wait so many seconds for the task to end, well or not, on every rank."""
        request = self.comm.Ibarrier()
        until = time.monotonic() + patience
        while self.broken and time.monotonic() < until:
            self.broken = not request.Test()
            time.sleep(POLL_S)


_pool: ContextVar[RankPool | None] = ContextVar("pool", default=None)
