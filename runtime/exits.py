"""Ends of a command: exit codes, messages of one line on standard error, and interruption.

A command is interrupted by Ctrl-C, SIGTERM of a batch system or container, or SIGHUP of a closed terminal. A
signal that is ignored when the program starts, as SIGINT in a shell's background and SIGHUP under nohup,
stays ignored.
"""

import os
import signal
import sys
import threading
from collections.abc import Iterator
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
def interruptible(*, at_once: bool = False) -> Iterator[None]:
    """Raise KeyboardInterrupt in the block for every signal that asks the program to end.

    Only the main thread can do so.

    Args:
        at_once: Whether the program ends there with one line instead. For imports, which have nothing to
            undo: a library that is interrupted while it is imported may say that it is missing.
    """

    def end(number: int, frame: FrameType | None) -> NoReturn:
        if at_once:
            say("interrupted")
            os._exit(INTERRUPTED)
        _signals.append(number)
        raise KeyboardInterrupt

    _signals.clear()
    able = threading.current_thread() is threading.main_thread()
    asking = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP) if able else ()
    before = {each: signal.getsignal(each) for each in asking}
    before = {number: former for number, former in before.items() if former is not signal.SIG_IGN}
    for number in before:
        signal.signal(number, end)
    try:
        yield
    finally:
        for number, former in before.items():
            signal.signal(number, former)


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
