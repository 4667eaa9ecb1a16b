"""Work on the newest item alone, in a thread, for items that come faster than the work is done."""

from collections.abc import Callable
from threading import Condition, Thread
from typing import Generic, Self, TypeVar

Newest = TypeVar("Newest")


class NewestOnly(Generic[Newest]):
    """Does work on items in a thread: always on the newest one, on none twice; the others are passed over.

    A context manager, at whose end the last item is worked on. An error in the work ends the thread and is
    raised by `finish`.

    Args:
        work: Called with an item.

    Attributes:
        passed_over: Number of items that were not worked on.
    """

    def __init__(self, work: Callable[[Newest], None]) -> None:
        self._work = work
        self._changed = Condition()
        self._waiting: list[Newest] = []
        self._ended = False
        self._error: BaseException | None = None
        self._thread = Thread(target=self._run, daemon=True)
        self.passed_over = 0

    def put(self, item: Newest) -> None:
        """Leave an item to be worked on, in place of one that waits."""
        with self._changed:
            self.passed_over += len(self._waiting)
            self._waiting = [item]
            self._changed.notify()

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self.finish()
        else:
            self._end()

    def finish(self) -> None:
        """Wait until the last item is done; none may follow."""
        self._end()
        if self._error is not None:
            raise self._error

    def _end(self) -> None:
        with self._changed:
            self._ended = True
            self._changed.notify()
        self._thread.join()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self._ended)
                if not self._waiting:
                    return
                item = self._waiting.pop()
            try:
                self._work(item)
            except BaseException as error:  # raised in the thread that waits for this one
                self._error = error
                return
