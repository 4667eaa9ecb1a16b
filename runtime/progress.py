"""Progress: the function by which work tells its caller how far it is."""

from collections.abc import Callable

Progress = Callable[[float, str], None]
"""Called with the fraction done (0 to 1) and a short text; quick work may ignore it."""


def silent(fraction: float, text: str) -> None:
    """Discard the progress."""
