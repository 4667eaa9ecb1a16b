"""Ends of a command: exit codes, messages of one line on standard error, and interruption.

A command is interrupted by Ctrl-C, SIGTERM of a batch system or container, or SIGHUP of a closed terminal. A
signal that is ignored when the program starts, as SIGINT in a shell's background and SIGHUP under nohup,
stays ignored.
"""

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NoReturn
from unicodedata import category

_signals: list[int] = []
"""The signals that asked this program to end."""

BAD_INPUT, NOT_CONVERGED, INTERRUPTED, UNREAD = 2, 3, 130, 141


def say(message: str) -> None:
    """Print a message as one line on standard error."""
    print(shown(" ".join(message.split())), file=sys.stderr)


def shown(text: str) -> str:
    """A text of others without control characters, line ends apart, and without marks that reorder it."""
    hidden = {each for each in text if category(each) in ("Cc", "Cf")} - {"\n"}
    return text.translate(dict.fromkeys(map(ord, hidden), "\N{REPLACEMENT CHARACTER}"))


@contextmanager
def ending_at_once() -> Iterator[None]:
    """End the program with one line if the block is interrupted; for imports, which have nothing to undo.

    A library that is interrupted while it is imported may say that it is missing.
    """

    def end(number: int, frame: FrameType | None) -> NoReturn:
        say("interrupted")
        os._exit(INTERRUPTED)

    with _handled(end):
        yield


@contextmanager
def interruptible() -> Iterator[None]:
    """Raise KeyboardInterrupt in the block for every signal that asks the program to end."""
    _signals.clear()

    def end(number: int, frame: FrameType | None) -> NoReturn:
        _signals.append(number)
        raise KeyboardInterrupt

    with _handled(end):
        yield


@contextmanager
def errors_of_interruption() -> Iterator[None]:
    """Raise KeyboardInterrupt for any error of the block after a signal that asks the program to end.

    A library that waits may turn it into an error of its own, such as `release unlocked lock`.
    """
    try:
        yield
    except Exception as error:
        if _signals:
            raise KeyboardInterrupt from error
        raise


@contextmanager
def _handled(handler: Callable[[int, FrameType | None], NoReturn]) -> Iterator[None]:
    """The block with a handler of the signals; only the main thread can have one."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {each: signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    ours = [number for number, former in before.items() if former is not signal.SIG_IGN]
    for number in ours:
        signal.signal(number, handler)
    try:
        yield
    finally:
        for number in ours:
            signal.signal(number, before[number])
