"""Interruption of a command: Ctrl-C, SIGTERM of a batch system or container, SIGHUP of a closed terminal.

A signal that is ignored when the program starts, as SIGINT in a shell's background and SIGHUP under nohup,
stays ignored.
"""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NoReturn

from compare.runtime.exits import INTERRUPTED, say
from geometry.processes import leave_signals_alone

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


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
    leave_signals_alone(os.environ)
    with _handled(signal.default_int_handler):
        yield


@contextmanager
def _handled(handler: Callable[[int, FrameType | None], NoReturn]) -> Iterator[None]:
    """The block with a handler of the signals; only the main thread can have one."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in SIGNALS}
    ours = [number for number in SIGNALS if before[number] is not signal.SIG_IGN]
    for number in ours:
        signal.signal(number, handler)
    try:
        yield
    finally:
        for number in ours:
            signal.signal(number, before[number])
