"""Runs a command and turns errors into exit codes."""

import logging
import os
import sys
import warnings
from collections.abc import Callable
from contextlib import redirect_stdout, suppress
from functools import partial
from io import StringIO, TextIOWrapper
from typing import Any, TextIO

from cyclopts import CycloptsError, UnusedCliTokensError, ValidationError

from pinnray.runtime.cache import share_cache
from pinnray.runtime.errors import UserError
from pinnray.runtime.exits import BAD_INPUT, INTERRUPTED, UNREAD, errors_of_interruption, say

EPILOGUE = (
    "Exit codes: 0 all well; 1 a fault of the program; 2 bad input, with one line that says what and how to "
    "mend it; 3 done, but a solver failed or did not converge, or --adapt did not reach its tolerance; "
    "130 interrupted; 141 the output went into a pipe that nobody reads any more. "
    "Every command takes --quiet: no progress and no results, only warnings and errors."
)

SIZES = range(20, 1001)
"""Columns and lines that a terminal may have."""


def launched(command: Callable[[], Any], *, quiet: bool = False) -> int:
    """Run a command, which shows only warnings and errors if it is quiet, and return its exit code."""
    _write_any_letter()
    _drop_impossible_sizes()
    _leave_signals_alone()
    return guarded(partial(_run, command, quiet))


def _run(command: Callable[[], Any], quiet: bool) -> Any:
    """Run a command, without its progress and its output if it is quiet."""
    share_cache()
    if not quiet:
        return command()
    from pinnray.runtime.stages import quiet_stages

    with redirect_stdout(StringIO()), quiet_stages():
        return command()


def guarded(command: Callable[[], Any]) -> int:
    """Run a command and return its exit code; faults of the program itself pass, with their traceback.

    A closed pipe, as of `compare | head -1`, ends it without a message and with a shell's code for SIGPIPE.
    """
    try:
        return _with_messages(command)
    except (BrokenPipeError, SystemExit) as end:
        if isinstance(end, SystemExit) and not isinstance(end.__context__, BrokenPipeError):  # Rich's way
            raise
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError):
                _flush(stream)
        return UNREAD


def _with_messages(command: Callable[[], Any]) -> int:
    """Run a command, with errors and warnings as lines on standard error, and return its exit code."""
    with warnings.catch_warnings():
        logging.captureWarnings(True)  # FFCx does when it is imported, which would undo the next line
        warnings.showwarning = lambda message, *_, **__: say(f"warning: {message}")
        try:
            try:
                with errors_of_interruption():
                    return int(command() or 0)
            finally:
                _flush(sys.stdout)
        except UnusedCliTokensError as error:
            say(f"error: {' '.join(error.unused_tokens or ())!r} belongs to no option; see --help")
        except ValidationError as error:  # of settings that are given as options
            from pydantic import ValidationError as Invalid

            cause = error.__cause__
            problems = cause.errors() if isinstance(cause, Invalid) else []
            said = [problem["msg"].removeprefix("Value error, ") for problem in problems] or [str(error)]
            say(f"error: {'; '.join(said)}")
        except (UserError, CycloptsError) as error:
            say(f"error: {error}")
        except BrokenPipeError:
            raise
        except OSError as error:
            say(f"error: {error.filename or 'input or output'}: {error.strerror or error}")
        except KeyboardInterrupt as interrupt:
            say(f"interrupted; {interrupt}" if interrupt.args else "interrupted")
            return INTERRUPTED
    return BAD_INPUT


def _flush(stream: TextIO) -> None:
    """Write what a stream holds back; if it cannot, drop it: the program's end would fail on it."""
    try:
        stream.flush()
    except OSError:
        with suppress(OSError), open(os.devnull, "wb") as nowhere:
            os.dup2(nowhere.fileno(), stream.fileno())
        raise


def _write_any_letter() -> None:
    """Let letters that the terminal lacks come out as question marks, not as an error after the work.

    A stream that the caller has closed gives nothing, takes everything and shows nothing.
    """
    for name, mode in {"stdin": "r", "stdout": "w", "stderr": "w"}.items():
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")


def _drop_impossible_sizes() -> None:
    """Forget a width or height of the terminal that none has, as COLUMNS=0 of `docker exec` and editors."""
    for name in ("COLUMNS", "LINES"):
        given = os.environ.get(name, "")
        if not (given.isdecimal() and int(given) in SIZES):
            os.environ.pop(name, None)


def _leave_signals_alone() -> None:
    """Keep PETSc, whoever loads it, from ending the program at a signal with a page of text."""
    options = os.environ.get("PETSC_OPTIONS", "")
    if "-no_signal_handler" not in options:
        os.environ["PETSC_OPTIONS"] = f"{options} -no_signal_handler".strip()
