"""Write the explorer of a sweep's fields."""

from pathlib import Path

from pinnray.options.shared import OptionalOutputPath
from pinnray.runtime.errors import UserError


def command(sweep: Path, *, out: OptionalOutputPath = None) -> int:
    """Write a page that shows the deformed finger at any load of a sweep, while sliders move.

    The page is one file that needs no network. The study must have kept fields: strokes = 10 in its file.
    An emulator is fitted the first time, and again when there are more samples.

    Args:
        sweep: Folder of `pinnray sweep`.
        out: HTML file; default: explore.html in that folder.
    """
    from pinnray.runtime.stages import Stages
    from pinnray.studies.fields.explorer import write_explorer
    from pinnray.studies.fields.store import fields_of

    path = out or sweep / "explore.html"
    if path.suffix.lower() != ".html":
        raise UserError(f"--out {path}: give the name of an HTML file, such as explore.html")
    with Stages() as stages:
        emulator = fields_of(sweep, stages)
        with stages.stage("page") as progress:
            size = write_explorer(emulator, path).stat().st_size
            progress(1.0, f"{size / 1e6:.1f} MB")
    print(path)
    return 0
