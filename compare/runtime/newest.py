"""Work on the newest item alone, in a thread, for items that come faster than the work is done."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Generic, Self, TypeVar

Newest = TypeVar("Newest")


class NewestOnly(Generic[Newest]):
    """Does work on items in a thread: always on the newest one, on none twice; the others are passed over.

    A context manager, at whose end the last item is worked on. An error in the work is raised by `finish`,
    which may be called before the end; no item may follow it.
    """

    def __init__(self, work: Callable[[Newest], None]) -> None:
        self.passed_over = 0  #: Number of items that were not worked on.
        self._work = work
        self._thread = ThreadPoolExecutor(max_workers=1)
        self._taken: list[Future[None]] = []

    def put(self, item: Newest) -> None:
        """Leave an item to be worked on, in place of one that waits."""
        if self._taken and self._taken[-1].cancel():
            self._taken.pop()
            self.passed_over += 1
        self._taken.append(self._thread.submit(self._work, item))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._thread.shutdown()
        if kind is None:
            self.finish()

    def finish(self) -> None:
        """Wait until the last item is done."""
        self._thread.shutdown()
        for work in self._taken:
            work.result()
