"""Worker processes for many samples: on this machine, or those of a Dask scheduler.

A worker may die at any time: its samples go to another one. A sample that is there at `DEATHS` deaths of
workers is taken to be their cause.
"""

import logging
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from itertools import islice, zip_longest
from math import inf
from typing import TYPE_CHECKING, Self

from pinnray.runtime.errors import UserError
from pinnray.runtime.processes.child import ProcessFailed
from pinnray.runtime.processes.pool import Pool
from pinnray.studies.sweep.job import Task
from pinnray.studies.sweep.measurement import OUT_OF_TIME, Measurement, measured

if TYPE_CHECKING:
    from distributed import Client

DEATHS = 8
"""Deaths of its worker after which a sample counts as failed.

Samples that wait for a dying worker of a scheduler count too: where one is killed at random every three
seconds, one of 10,000 samples has eight by chance with a probability below 1e-3.
"""

GRACE, GRACE_S = 1.5, 10.0
"""A worker whose sample does not stop at its limit of time is ended after so many times the limit and so many
seconds more, for what it has to load first."""

WAIT_S = 20
"""Time to reach a scheduler, s."""


class Workers:
    """Worker processes, which are started when they are first needed; a context manager that ends them.

    Args:
        count: Number of processes on this machine, if there is no scheduler.
        scheduler: Address of a Dask scheduler whose workers are used instead, such as tcp://host:8786.
    """

    def __init__(self, count: int, scheduler: str | None = None) -> None:
        self._count, self._scheduler = count, scheduler
        self._stack = ExitStack()
        self._pool = self._stack.enter_context(Pool(count))
        self._client: Client | None = None
        self._warm = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def answers(self, tasks: Mapping[int, Task]) -> Iterator[Measurement]:
        """Run tasks and yield their results as they come, each once.

        The first tasks run alone, one on each machine: they compile the forms of FEniCS, which all would
        compile at once if its cache is empty.

        Raises:
            UserError: If the scheduler does not answer or has no workers.
        """
        if self._scheduler is not None and self._client is None:
            self._client = self._stack.enter_context(_connected(self._scheduler))
        run = self._here if self._client is None else self._at_scheduler
        first = 0 if self._warm else 1 if self._client is None else len(_one_each(self._client))
        yield from run(dict(islice(tasks.items(), first)))
        self._warm = True
        yield from run(dict(islice(tasks.items(), first, None)))

    def _here(self, tasks: Mapping[int, Task]) -> Iterator[Measurement]:
        limit = next((task.time_limit for task in tasks.values()), None)
        hard = inf if limit is None else GRACE * limit + GRACE_S
        for number, answer in self._pool.answers(_measured, tasks, deaths=DEATHS, timeout_s=hard):
            if not isinstance(answer, ProcessFailed):
                yield answer
            elif answer.exit_code is None:
                yield Measurement(number, "not converged", f"{OUT_OF_TIME}: after {hard:.3g} s", hard)
            else:
                yield _failed(number)

    def _at_scheduler(self, tasks: Mapping[int, Task]) -> Iterator[Measurement]:
        from distributed import KilledWorker, as_completed

        client, deaths = self._client, Counter[int]()
        assert client is not None
        places = [] if self._warm else _one_each(client)
        running = {
            client.submit(measured, task, pure=False, workers=place, allow_other_workers=bool(place)): number
            for (number, task), place in zip_longest(tasks.items(), places[: len(tasks)])
        }
        answers = as_completed(list(running))
        for future in answers:
            number = running.pop(future)
            try:
                yield future.result()
            except KilledWorker:
                deaths[number] += 1
                if deaths[number] == DEATHS:
                    yield _failed(number)
                else:
                    again = client.submit(measured, tasks[number], pure=False)
                    running[again] = number
                    answers.add(again)


def _measured(task: Task, report: Callable[..., None]) -> Measurement:
    return measured(task)


def _failed(number: int) -> Measurement:
    return Measurement(number, "failed", f"its worker process died {DEATHS} times", 0.0)


def _one_each(client: "Client") -> list[str]:
    """Address of one worker on each machine."""
    return list({address.rpartition(":")[0]: address for address in client.nthreads()}.values())


def _connected(address: str) -> "Client":
    """A client of a scheduler that has workers."""
    from distributed import Client

    for name in ("distributed", "tornado"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        client: Client = Client(address, timeout=WAIT_S)
    except (OSError, ValueError) as error:
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise UserError(f"scheduler {address}: no Dask scheduler answers there ({reason})") from None
    if not client.nthreads():
        client.close()
        raise UserError(f"scheduler {address}: the scheduler has no workers; start some first")
    return client
