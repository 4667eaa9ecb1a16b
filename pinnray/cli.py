"""The command line: `compare`, the main job, and `pinnray` with every command.

The rest is imported when Ctrl-C no longer gives a traceback.
"""

import atexit
import gc
import os
import sys

from pinnray.runtime.exits import interruptible

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
"""The matrices are small: more threads of the linear algebra only cost a core, waiting for one another.

And so the sums have one order, whatever the number of cores. Read when NumPy and PETSc are loaded.
"""

QUIET = "--quiet"
"""Taken by the program, whatever its command."""


def main(arguments: list[str] | None = None) -> int:
    """Entry of `pinnray`."""
    atexit.register(gc.freeze)  # the end would look for garbage among all that the libraries hold: a second
    with interruptible(at_once=True):
        from pinnray.commands.app import pinnray
        from pinnray.commands.launch import launched
    given = sys.argv[1:] if arguments is None else arguments
    words = [word for word in given if word != QUIET]
    with interruptible():
        return launched(
            lambda: pinnray(words, exit_on_error=False, print_error=False), quiet=len(words) < len(given)
        )


def compare_main(arguments: list[str] | None = None) -> int:
    """Entry of `compare`: the same as `pinnray compare`."""
    given = sys.argv[1:] if arguments is None else arguments
    return main(["compare", *given])


if __name__ == "__main__":
    sys.exit(main())
