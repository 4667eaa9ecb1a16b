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
from signal import SIGKILL
from typing import TYPE_CHECKING, Self

from pinnray.runtime.errors import UserError
from pinnray.runtime.processes.child import ProcessFailed
from pinnray.runtime.processes.pool import Input, Name, Output, Pool

if TYPE_CHECKING:
    from distributed import Client

DEATHS = 8
"""Deaths of its worker after which a sample counts as failed.

Samples that wait for a dying worker of a scheduler count too: where one is killed at random every three
seconds, one of 10,000 samples has eight by chance with a probability below 1e-3.
"""

WAIT_S = 20
"""Time to reach a scheduler, s."""


class Workers:
    """Worker processes, which are started when they are first needed; a context manager that ends them.

    Args:
        count: Number of processes on this machine, if there is no scheduler.
        scheduler: Address of a Dask scheduler whose workers are used instead, such as tcp://host:8786.
        threads: Threads of each process; see `Pool`.
        warm: Whether no task has to run alone first; see `answers`.
    """

    def __init__(
        self, count: int, scheduler: str | None = None, *, threads: int = 1, warm: bool = False
    ) -> None:
        self._scheduler, self._stack = scheduler, ExitStack()
        self._pool = self._stack.enter_context(Pool(count, threads=threads))
        self._client: Client | None = None
        self._warm = warm

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def answers(
        self,
        work: Callable[[Input, Callable[..., None]], Output],
        tasks: Mapping[Name, Input],
        *,
        report: Callable[..., None] = lambda *_: None,
        timeout_s: float = inf,
        deaths: int,
    ) -> Iterator[tuple[Name, Output | ProcessFailed]]:
        """Run tasks and yield their answers as they come, each once; see `Pool.answers`.

        The first tasks run alone, one on each machine: they compile the forms of FEniCS, which all would
        compile at once if its cache is empty. Those of a scheduler report nothing, and have no limit of time.

        Raises:
            UserError: If the scheduler does not answer or has no workers.
        """
        if self._scheduler is not None and self._client is None:
            self._client = self._stack.enter_context(_connected(self._scheduler))
        first = 0 if self._warm else 1 if self._client is None else len(_one_each(self._client))
        for part in (dict(islice(tasks.items(), first)), dict(islice(tasks.items(), first, None))):
            if self._client is not None:
                yield from self._at_scheduler(work, part, deaths)
            else:
                yield from self._pool.answers(work, part, report=report, timeout_s=timeout_s, deaths=deaths)
            self._warm = True

    def _at_scheduler(
        self, work: Callable[[Input, Callable[..., None]], Output], tasks: Mapping[Name, Input], most: int
    ) -> Iterator[tuple[Name, Output | ProcessFailed]]:
        from distributed import KilledWorker, as_completed

        client, deaths = self._client, Counter[Name]()
        assert client is not None
        places = [] if self._warm else _one_each(client)
        running = {
            client.submit(_alone, work, task, pure=False, workers=at, allow_other_workers=bool(at)): name
            for (name, task), at in zip_longest(tasks.items(), places[: len(tasks)])
        }
        answers = as_completed(list(running))
        for future in answers:
            name = running.pop(future)
            try:
                yield name, future.result()
            except KilledWorker:
                deaths[name] += 1
                if deaths[name] == most:
                    yield name, ProcessFailed(-SIGKILL)
                else:
                    again = client.submit(_alone, work, tasks[name], pure=False)
                    running[again] = name
                    answers.add(again)


def _alone(work: Callable[[Input, Callable[..., None]], Output], task: Input) -> Output:
    """The answer of a task to which nobody listens on the way."""
    return work(task, lambda *_: None)


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
