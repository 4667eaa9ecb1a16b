"""Exit codes, and messages of one line on standard error."""

import sys

BAD_INPUT, NOT_CONVERGED, INTERRUPTED, UNREAD = 2, 3, 130, 141


def say(message: str) -> None:
    """Print a message as one line on standard error."""
    print(" ".join(message.split()), file=sys.stderr)
