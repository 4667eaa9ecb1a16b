"""Worker processes for many samples: on this machine, or those of a Dask scheduler.

A worker may die at any time: its samples go to another one. A sample that is there at `DEATHS` deaths of
workers is taken to be their cause.
"""

import logging
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

from compare.sweep.measurement import Measurement, measured
from compare.sweep.study import Task
from geometry.errors import UserError

if TYPE_CHECKING:
    from distributed import Client

DEATHS = 8
"""Deaths of its worker after which a sample counts as failed.

Samples that wait for a dying worker count too: where one is killed at random every three seconds, one of
10,000 samples has eight by chance with a probability below 1e-3.
"""

AHEAD = 2
"""Samples sent to each worker at a time: one in work, one that waits."""

WAIT_S = 20
"""Time to reach a scheduler, s."""


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
    from distributed import Client, LocalCluster

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
    with (
        LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            processes=True,
            dashboard_address=None,
            memory_limit=0,
            silence_logs=logging.CRITICAL,
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client


def answers(client: "Client", tasks: Mapping[int, Task]) -> Iterator[Measurement]:
    """Run tasks and yield their results as they come, each once.

    The first task runs alone on one worker of each machine: it compiles the forms of FEniCS, which parallel
    starts with an empty cache would compile all at once.
    """
    from distributed import KilledWorker, as_completed

    waiting = iter(tasks.items())
    deaths: Counter[int] = Counter()
    number_of: dict[Any, int] = {}

    def submit(number: int) -> Any:
        future = client.submit(measured, tasks[number], pure=False)
        number_of[future] = number
        return future

    for future in _warm(client, tasks[next(iter(tasks))]):
        with suppress(KilledWorker):
            future.result()
    running = as_completed([])
    pending = 0
    while True:
        room = max(sum(client.nthreads().values()), 1) * AHEAD
        while pending < room and (entry := next(waiting, None)) is not None:
            running.add(submit(entry[0]))
            pending += 1
        if not pending:
            return
        future = next(running)
        number = number_of.pop(future)
        try:
            answer = future.result()
        except KilledWorker:
            deaths[number] += 1
            if deaths[number] < DEATHS:
                running.add(submit(number))
                continue
            answer = Measurement(number, "failed", f"its worker process died {DEATHS} times", 0.0)
        pending -= 1
        yield answer


def _warm(client: "Client", task: Task) -> list[Any]:
    """The task on one worker of each machine."""
    one_each: dict[str, str] = {}
    for address in client.nthreads():
        one_each.setdefault(address.rpartition(":")[0], address)
    return [client.submit(measured, task, pure=False, workers=[address]) for address in one_each.values()]


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
