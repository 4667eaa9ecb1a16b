"""The option --quiet of every command."""

from collections.abc import Callable
from contextlib import redirect_stdout
from functools import wraps
from inspect import Parameter as Argument
from inspect import signature
from io import StringIO
from typing import Annotated, Any

from cyclopts import Parameter

from pinnray.options.shared import OUTPUT

Quiet = Annotated[bool, Parameter(group=OUTPUT, help="Show no progress and print only warnings and errors.")]


def quietable(command: Callable[..., int]) -> Callable[..., int]:
    """The command with an option --quiet."""

    @wraps(command)
    def run(*positional: Any, quiet: bool = False, **named: Any) -> int:
        if not quiet:
            return command(*positional, **named)
        from pinnray.runtime.stages import quiet_stages

        with redirect_stdout(StringIO()), quiet_stages():
            return command(*positional, **named)

    arguments = signature(command)
    added = Argument("quiet", Argument.KEYWORD_ONLY, default=False, annotation=Quiet)
    run.__signature__ = arguments.replace(parameters=[*arguments.parameters.values(), added])  # type: ignore[attr-defined]
    run.__annotations__ = {**command.__annotations__, "quiet": Quiet}
    return run
