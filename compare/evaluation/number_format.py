"""Numbers as text, for tables, pictures and sentences."""

from math import isnan

NONE = "–"
"""Stands where there is no number."""
LEAST_PERCENT, LEAST_DISTANCE = 0.001, 0.0001
"""Smaller shares, %, and lengths, mm, are printed as less than this: they are as good as zero."""


def significant(value: float, digits: int) -> str:
    """A number with so many significant digits, without an exponent below a million."""
    return f"{float(f'{value:.{digits}g}'):g}"


def number(value: float, digits: int = 4) -> str:
    """The same with trailing zeros and a typographic minus; no exponent from 1 to a million."""
    text = f"{value:#.{digits}g}"
    if 1 <= abs(value) < 1e6:
        text = f"{float(text):.0f}" if "e" in text else text
    return text.rstrip(".").replace("-", "−")


def percent(share: float, digits: int = 3, *, sign: bool = True) -> str:
    """A share in per cent: so many significant digits, at least all before the point; a dash for NaN.

    Args:
        share: 0.123 is 12.3 %.
        digits: How many significant digits.
        sign: Whether the per cent sign follows, after a no-break space.
    """
    if isnan(share):
        return NONE
    value = 100 * share
    if value == 0:
        text = "0"
    elif abs(value) < LEAST_PERCENT:
        text = f"{'>' if value < 0 else '<'} {'−' * (value < 0)}{LEAST_PERCENT}".replace(
            " ", "\N{NO-BREAK SPACE}"
        )
    else:
        text = f"{value:.0f}".replace("-", "−") if abs(value) >= 10**digits else number(value, digits)
    return f"{text}\N{NO-BREAK SPACE}%" if sign else text


def distance(value: float) -> str:
    """A small length, mm, with two significant digits; a dash for NaN, zero for rounding errors."""
    if isnan(value):
        return NONE
    if value > 1e-9 and value < LEAST_DISTANCE:
        return f"<\N{NO-BREAK SPACE}{LEAST_DISTANCE}"
    return f"{value if value > 1e-9 else 0:.2g}"
