"""Work on the newest item alone, in a thread, for items that come faster than the work is done."""

from collections.abc import Callable
from contextlib import suppress
from queue import Empty, Queue
from threading import Thread
from typing import Generic, Self, TypeVar

Newest = TypeVar("Newest")


class NewestOnly(Generic[Newest]):
    """Does work on items in a thread: always on the newest one, on none twice; the others are passed over.

    A context manager, at whose end the last item is worked on. An error ends the work and is raised by
    `finish`, which may be called before the end; no item may follow it.
    """

    def __init__(self, work: Callable[[Newest], None]) -> None:
        self.passed_over = 0  #: Number of items that were not worked on.
        self._work = work
        self._waiting: Queue[Newest | None] = Queue(maxsize=1)  # None is the end
        self._error: BaseException | None = None
        self._thread = Thread(target=self._run, daemon=True)

    def put(self, item: Newest) -> None:
        """Leave an item to be worked on, in place of one that waits."""
        with suppress(Empty):
            self._waiting.get_nowait()
            self.passed_over += 1
        self._waiting.put(item)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._end()
        if kind is None:
            self.finish()

    def finish(self) -> None:
        """Wait until the last item is done."""
        self._end()
        if self._error is not None:
            raise self._error

    def _end(self) -> None:
        if self._thread.is_alive():
            self._waiting.put(None)
            self._thread.join()

    def _run(self) -> None:
        for item in iter(self._waiting.get, None):
            if self._error is None:
                try:
                    self._work(item)
                except BaseException as error:  # raised in the thread that waits for this one
                    self._error = error
