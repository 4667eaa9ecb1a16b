"""Worker processes for many samples: on this machine, or those of a Dask scheduler.

A worker may die at any time: its samples go to another one. A sample that is there at `DEATHS` deaths of
workers is taken to be their cause.
"""

import logging
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

from compare.sweep.measurement import Measurement, measured
from compare.sweep.study import Task
from geometry.errors import UserError

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

DEATHS = 8
"""Deaths of its worker after which a sample counts as failed.

Samples that wait for a dying worker count too: where one is killed at random every three seconds, one of
10,000 samples has eight by chance with a probability below 1e-3.
"""

AHEAD = 2
"""Samples sent to each worker at a time: one in work, one that waits."""

WAIT_S = 20
"""Time to reach a scheduler, s."""

WARM_S = 300
"""Time to compile the forms of FEniCS, s; it takes some ten seconds."""

LOOK_S = 5
"""Time between two looks whether workers are there, s."""

AWAY_S = 15
"""Time for which fewer workers of this machine than were started are taken to be starting, s."""

STARTS = 3
"""Attempts to start the worker processes."""


@contextmanager
def workers(count: int, scheduler: str | None = None) -> Iterator["Client"]:
    """Worker processes, connected.

    Args:
        count: Number of processes on this machine, if there is no scheduler.
        scheduler: Address of a Dask scheduler whose workers are used instead, such as tcp://host:8786.

    Raises:
        UserError: If the scheduler does not answer, or has no workers.
    """
    import dask
    from distributed import Client

    spawn = "distributed.nanny.pre-spawn-environ"  # one thread of OpenMP and BLAS a worker, among others
    dask.config.set(
        {
            spawn: {**dask.config.get(spawn), "DASK_LOGGING__DISTRIBUTED": "critical"},
            "distributed.scheduler.allowed-failures": 0,  # the deaths are counted here
            "distributed.scheduler.worker-saturation": 1.0,
        }
    )
    for name in ("distributed", "tornado"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    if scheduler is not None:
        try:
            client = Client(scheduler, timeout=WAIT_S)
        except (OSError, ValueError) as error:
            raise UserError(
                f"--scheduler {scheduler}: no Dask scheduler answers there ({_first_line(error)})"
            ) from None
        with client:
            if not client.nthreads():
                raise UserError(f"--scheduler {scheduler}: the scheduler has no workers; start some first")
            yield client
        return
    with _local_cluster(count) as cluster, Client(cluster) as client:
        yield client


def _local_cluster(count: int) -> "LocalCluster":
    """Worker processes on this machine; a worker that dies while it starts is no reason to give up."""
    from distributed import LocalCluster

    for attempt in range(STARTS):
        try:
            return LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                processes=True,
                dashboard_address="127.0.0.1:0",
                memory_limit=0,
                silence_logs=logging.CRITICAL,
            )
        except RuntimeError as error:
            if attempt == STARTS - 1:
                raise UserError(f"the worker processes do not start: {_first_line(error)}") from None
    raise AssertionError


def answers(client: "Client", tasks: Mapping[int, Task]) -> Iterator[Measurement]:
    """Run tasks and yield their results as they come, each once.

    The first task runs alone on one worker of each machine: it compiles the forms of FEniCS, which parallel
    starts with an empty cache would compile all at once.

    Ends early if workers on this machine stay away: one that dies while it starts is not started again. Those
    of a scheduler may come and go.
    """
    from distributed import KilledWorker, wait

    waiting = iter(tasks)
    deaths: Counter[int] = Counter()
    running: dict[Any, int] = {}

    def submit(number: int) -> None:
        running[client.submit(measured, tasks[number], pure=False)] = number

    _warm(client, tasks[next(iter(tasks))])
    wanted = _threads(client) if client.cluster is not None else 0
    complete = time.monotonic()
    while True:
        while len(running) < max(_threads(client), 1) * AHEAD and (number := next(waiting, None)) is not None:
            submit(number)
        if not running:
            return
        try:
            finished = wait(list(running), timeout=LOOK_S, return_when="FIRST_COMPLETED").done
        except TimeoutError:
            finished = set()
        if _threads(client) >= wanted:
            complete = time.monotonic()
        elif time.monotonic() > complete + AWAY_S:
            return
        for future in finished:
            number = running.pop(future)
            try:
                answer = future.result()
            except KilledWorker:
                deaths[number] += 1
                if deaths[number] < DEATHS:
                    submit(number)
                    continue
                answer = Measurement(number, "failed", f"its worker process died {DEATHS} times", 0.0)
            yield answer


def _threads(client: "Client") -> int:
    return sum(client.nthreads().values())


def _warm(client: "Client", task: Task) -> None:
    """Run the task on one worker of each machine."""
    from distributed import KilledWorker

    one_each: dict[str, str] = {}
    for address in client.nthreads():
        one_each.setdefault(address.rpartition(":")[0], address)
    started = [client.submit(measured, task, pure=False, workers=[address]) for address in one_each.values()]
    for future in started:
        with suppress(KilledWorker, TimeoutError):
            future.result(timeout=WARM_S)
        future.cancel()


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
