"""The end of a program that is interrupted inside a library."""

import signal
from pathlib import Path

import pytest

from pinnray.commands.launch import launched
from pinnray.options.shared import going_on_from
from pinnray.runtime.exits import INTERRUPTED, interruptible


def test_an_error_that_a_signal_caused_is_the_interruption(capsys: pytest.CaptureFixture[str]) -> None:
    """A library that waits may answer a signal by an error of its lock."""

    def waiting() -> None:
        with going_on_from(Path("out/search")):
            try:
                signal.raise_signal(signal.SIGTERM)
            except KeyboardInterrupt:
                raise RuntimeError("release unlocked lock") from None

    with interruptible():
        assert launched(waiting) == INTERRUPTED
    said = capsys.readouterr().err
    assert said == "interrupted; the same command goes on from what out/search keeps\n"


def test_an_error_without_a_signal_stays_one() -> None:
    def broken() -> None:
        raise RuntimeError("release unlocked lock")

    with interruptible(), pytest.raises(RuntimeError, match="unlocked"):
        launched(broken)
