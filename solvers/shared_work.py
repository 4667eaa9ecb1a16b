"""Work that several solvers of one problem have in common, such as a factorised stiffness, done once."""

from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar, cast

_KEPT: ContextVar[dict[Hashable, object] | None] = ContextVar("_KEPT", default=None)

Work = TypeVar("Work")


class SharedWork:
    """Results by their keys, which live as long as this object."""

    def __init__(self) -> None:
        self._kept: dict[Hashable, object] = {}

    @contextmanager
    def used(self) -> Iterator[None]:
        """Let solvers in the block leave results here, and take what others left."""
        token = _KEPT.set(self._kept)
        try:
            yield
        finally:
            _KEPT.reset(token)


def is_shared() -> bool:
    """Whether `shared` keeps results."""
    return _KEPT.get() is not None


def shared(key: Hashable, make: Callable[[], Work]) -> Work:
    """The result under a key, which holds all it depends on; it is kept only inside `SharedWork.used`."""
    kept = _KEPT.get()
    if kept is None:
        return make()
    if key not in kept:
        kept[key] = make()
    return cast(Work, kept[key])
