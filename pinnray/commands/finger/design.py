"""Draw the finger."""

from pathlib import Path

from pinnray.options.shared import FingerOptions, OutputPath, comma_list
from pinnray.runtime.errors import UserError

STEP = "finger"
"""Name of the STEP file, beside which its clamp and contact lie."""
CAD_FILES = ("finger.step", "finger-body.stl", "finger-markers.stl", "section.dxf")
PICTURE = "design.png"


def command(
    *,
    finger: FingerOptions = FingerOptions(),
    out: OutputPath = Path("out/cad"),
    formats: str = "step,stl,dxf",
) -> int:
    """Draw the finger: CAD files of the body and its markers, and a picture to scale.

    A .toml file has clamp, contact and markers as lines to change: those of finger.step or, with --section,
    of the drawing, with what was proposed.

    Args:
        out: Output folder.
        formats: File formats, separated by commas: step, stl, dxf.
    """
    from pinnray.geometry.cache import cad_files
    from pinnray.geometry.drawing.drawn_finger import DrawnFinger, description_lines
    from pinnray.runtime.atomic import write_text
    from pinnray.runtime.exits import say

    chosen, _ = finger.read()
    stem = Path(chosen.file).stem if isinstance(chosen, DrawnFinger) else STEP
    lines = out / f"{stem}.toml"
    kinds = comma_list(formats)
    names = [lines.name, PICTURE, *(name for name in CAD_FILES if name.endswith(tuple(kinds)))]
    written = [out / name for name in names]
    for given in finger.files():
        if any(path.exists() and path.samefile(given) for path in written):
            raise UserError(f"--out {out}: this would overwrite {given}, which is read; name another folder")
    paths = cad_files(chosen, out, formats=kinds)
    write_text(lines, description_lines(chosen))
    if isinstance(chosen, DrawnFinger):
        say(f"note: {chosen.file} was read as {chosen.note}")
    picture = chosen.plot().save(out / PICTURE)
    print(*paths, lines, picture, sep="\n")
    return 0
