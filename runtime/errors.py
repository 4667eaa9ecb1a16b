"""Errors of the user's input; the command line prints them as one line and exits with code 2."""


class UserError(ValueError):
    """Invalid input: the message names the place, the fault and the remedy."""


class ShapeError(UserError):
    """An array has the wrong shape."""


class OutsideBodyError(UserError):
    """A point lies outside the body, where fields are undefined."""


class InapplicableError(UserError):
    """A part of a job does not apply to this case; its stage leaves no trace."""
