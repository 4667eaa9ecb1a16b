"""How a command starts: in one process, or on the ranks of an `mpirun`."""

import os
from collections.abc import Callable
from typing import Any

from compare.runtime.exits import guarded
from geometry.errors import UserError

SIZES = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE")
"""Where Open MPI and the relatives of MPICH say how many ranks they have started."""


def launched(command: Callable[[], Any]) -> int:
    """Run a command and give its exit code; of several ranks one runs it, and the others serve its solves."""
    alone = all(os.environ.get(name, "1") == "1" for name in SIZES)
    return guarded(command if alone else lambda: _on_ranks(command))


def _on_ranks(command: Callable[[], Any]) -> int:
    try:
        from solvers.fem.ranks import lead
    except ImportError as error:
        raise UserError(f"mpirun needs {error.name}, which comes with DOLFINx; run without it") from None
    return lead(command, guarded)
