"""How a command ends: its exit code, and one line on standard error for what a user can mend."""

import sys
import warnings
from collections.abc import Callable
from typing import Any, TextIO

import pydantic
from cyclopts import CycloptsError, UnusedCliTokensError, ValidationError

from geometry.errors import UserError

BAD_INPUT, NOT_CONVERGED, INTERRUPTED = 2, 3, 130
EXIT_CODES = (
    "Exit codes: 0 all well; 1 a fault of the program; 2 bad input, with one line that says what and how to "
    "mend it; 3 done, but a solver did not converge or --adapt did not reach its tolerance; 130 interrupted."
)


def guarded(command: Callable[[], Any]) -> int:
    """Run a command and give its exit code; faults of the program itself pass, with their traceback."""
    with warnings.catch_warnings():
        warnings.showwarning = _show_warning
        try:
            return int(command() or 0)
        except UnusedCliTokensError as error:
            say(f"error: {' '.join(error.unused_tokens or ())!r} belongs to no option; see --help")
        except ValidationError as error:  # of settings that are given as options
            cause = error.__cause__
            problems = cause.errors() if isinstance(cause, pydantic.ValidationError) else []
            said = [problem["msg"].removeprefix("Value error, ") for problem in problems] or [str(error)]
            say(f"error: {'; '.join(said)}")
        except (UserError, CycloptsError) as error:
            say(f"error: {error}")
        except OSError as error:
            say(f"error: {error.filename or 'input or output'}: {error.strerror or error}")
        except KeyboardInterrupt as interrupt:
            say(f"interrupted; {interrupt}" if interrupt.args else "interrupted")
            return INTERRUPTED
    return BAD_INPUT


def say(message: str) -> None:
    """Print a message as one line on standard error."""
    print(" ".join(message.split()), file=sys.stderr)


def _show_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    say(f"warning: {message}")
