"""Worker processes for many samples: on this machine, or those of a Dask scheduler.

A worker may die at any time: its samples go to another one. A sample that is there at `DEATHS` deaths of
workers is taken to be their cause.
"""

import logging
import os
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any, Self

from geometry.errors import UserError
from geometry.worker import SAFE_PATH
from studies.sweep.measurement import Measurement, measured
from studies.sweep.study import Task

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

LOOK_S = 5
"""Time between two looks whether workers are there, s."""

AWAY_S = 15
"""Time for which fewer workers of this machine than were started are taken to be starting, s."""

STARTS = 3
"""Attempts to start the worker processes."""


class Workers:
    """Worker processes, which are started when they are first needed; a context manager that ends them.

    Args:
        count: Number of processes on this machine, if there is no scheduler.
        scheduler: Address of a Dask scheduler whose workers are used instead, such as tcp://host:8786.
    """

    def __init__(self, count: int, scheduler: str | None = None) -> None:
        self._count = count
        self._scheduler = scheduler
        self._stack = ExitStack()
        self._client: Client | None = None
        self._warm: set[str] = set()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def stop(self) -> None:
        """End the processes of this machine, and the connection to a scheduler."""
        self._stack.close()
        self._client = None
        self._warm.clear()

    def answers(self, tasks: Mapping[int, Task]) -> Iterator[Measurement]:
        """Run tasks and yield their results as they come, each once.

        The first tasks run alone, one on each machine that has not run any: they compile the forms of FEniCS,
        which parallel starts with an empty cache would compile all at once.

        Ends early if workers of this machine stay away: one that dies while it starts is not started again.
        Those of a scheduler may come and go.

        Raises:
            UserError: If the workers do not start, or the scheduler does not answer or has no workers.
        """
        from distributed import KilledWorker, wait

        client = self._client = self._client or self._connected()
        waiting = iter(tasks)
        deaths: Counter[int] = Counter()
        running: dict[Any, int] = {}

        def submit(number: int, machine: list[str] | None = None) -> Any:
            future = client.submit(
                measured, tasks[number], pure=False, workers=machine, allow_other_workers=machine is not None
            )
            running[future] = number
            return future

        warming = {
            submit(number, [address]) for address, number in zip(self._cold(client), waiting, strict=False)
        }
        complete = time.monotonic()
        while True:
            room = 0 if warming & running.keys() else max(_threads(client), 1) * AHEAD
            while len(running) < room and (number := next(waiting, None)) is not None:
                submit(number)
            if not running:
                return
            try:
                finished = wait(list(running), timeout=LOOK_S, return_when="FIRST_COMPLETED").done
            except TimeoutError:
                finished = set()
            if self._scheduler is not None or _threads(client) >= self._count:
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

    def _cold(self, client: "Client") -> list[str]:
        """One worker of each machine that has not run any task, which is taken to be warm from now on."""
        one_each: dict[str, str] = {}
        for address in client.nthreads():
            one_each.setdefault(address.rpartition(":")[0], address)
        cold = [address for machine, address in one_each.items() if machine not in self._warm]
        self._warm |= one_each.keys()
        return cold

    def _connected(self) -> "Client":
        import dask
        from distributed import Client

        spawn = "distributed.nanny.pre-spawn-environ"  # one thread of OpenMP and BLAS a worker, among others
        given = {**dask.config.get(spawn), **SAFE_PATH, "DASK_LOGGING__DISTRIBUTED": "critical"}
        self._stack.enter_context(_kept_variables([*given, "PYTHONHASHSEED"]))
        os.environ.update(SAFE_PATH)  # for the process that tracks resources, which starts before the workers
        dask.config.set(
            {
                spawn: given,
                "distributed.scheduler.allowed-failures": 0,  # the deaths are counted here
                "distributed.scheduler.worker-saturation": 1.0,
            }
        )
        for name in ("distributed", "tornado"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
        if self._scheduler is None:
            cluster = self._stack.enter_context(_local_cluster(self._count))
            local: Client = self._stack.enter_context(Client(cluster))
            return local
        try:
            client: Client = self._stack.enter_context(Client(self._scheduler, timeout=WAIT_S))
        except (OSError, ValueError) as error:
            raise UserError(
                f"--scheduler {self._scheduler}: no Dask scheduler answers there ({_first_line(error)})"
            ) from None
        if not client.nthreads():
            raise UserError(f"--scheduler {self._scheduler}: the scheduler has no workers; start some first")
        return client


@contextmanager
def _kept_variables(names: Sequence[str]) -> Iterator[None]:
    """Environment variables are as before after the block: Dask sets its workers' in this process, too."""
    before = {name: os.environ.get(name) for name in names}
    try:
        yield
    finally:
        for name, text in before.items():
            if text is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = text


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
                raise UserError(
                    f"the worker processes do not start ({_first_line(error)}); they run the calling script "
                    'once more: what it does must stand under `if __name__ == "__main__":`'
                ) from None
    raise AssertionError


def _threads(client: "Client") -> int:
    return sum(client.nthreads().values())


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
