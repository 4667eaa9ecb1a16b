"""Exit codes, and messages of one line on standard error."""

import sys

BAD_INPUT, NOT_CONVERGED, INTERRUPTED = 2, 3, 130


def say(message: str) -> None:
    """Print a message as one line on standard error."""
    print(" ".join(message.split()), file=sys.stderr)
