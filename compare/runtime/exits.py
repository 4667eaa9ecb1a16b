"""Exit codes, and messages of one line on standard error."""

import sys
from unicodedata import category

BAD_INPUT, NOT_CONVERGED, INTERRUPTED, UNREAD = 2, 3, 130, 141


def say(message: str) -> None:
    """Print a message as one line on standard error."""
    print(shown(" ".join(message.split())), file=sys.stderr)


def shown(text: str) -> str:
    """A text of others for a terminal, which obeys control characters: those but line ends are replaced.

    So are the formatting ones of Unicode, which can show a text in another order.
    """
    hidden = {each for each in text if category(each) in ("Cc", "Cf")} - {"\n"}
    return text.translate(dict.fromkeys(map(ord, hidden), "\N{REPLACEMENT CHARACTER}"))
