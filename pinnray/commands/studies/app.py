"""Serve the explorer of a sweep's fields, with a solver behind it."""

from pathlib import Path

from pinnray.commands.quiet import quietable
from pinnray.runtime.errors import UserError


@quietable
def command(sweep: Path, *, port: int = 8765, refit: bool = False) -> int:
    """Serve the explorer of a sweep, with fem-nonlinear behind it for what the sweep does not know.

    Only this machine is served, and only pages that it has served itself. Ctrl-C ends it.

    Args:
        sweep: Folder of `pinnray sweep`.
        port: Of this machine; 0 takes any that is free.
        refit: Fit the emulator again.
    """
    from pinnray.runtime.stages import Stages
    from pinnray.studies.fields.live import serve_explorer
    from pinnray.studies.fields.store import fields_of

    if not 0 <= port < 65536:
        raise UserError(f"--port {port}: give a number from 0 to 65535")
    with Stages() as stages:
        emulator = fields_of(sweep, refit=refit, stages=stages)
    serve_explorer(emulator, port, lambda address: print(f"{address}  (Ctrl-C ends)", flush=True))
    return 0
