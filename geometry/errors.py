"""Errors that a person can act on; the command line prints them as one line and exits with code 2."""


class UserError(ValueError):
    """Bad input: the message says what was wrong, where, and what would be right."""


class ShapeError(UserError):
    """An array has another shape than the interface asks for."""


class OutsideBodyError(UserError):
    """A field was asked for at a point outside the finger."""
