"""Draw the finger."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from compare.commands.options import FingerOptions


def design(
    finger: FingerOptions = FingerOptions(),
    *,
    out: Annotated[Path, Parameter(help="Folder for the files.")] = Path("out/cad"),
    formats: Annotated[str, Parameter(help="Some of step, stl, dxf, svg, with commas.")] = "step,stl,dxf,svg",
) -> int:
    """Draw the finger: CAD files of the solid, its markers separate bodies, and a dimensioned picture."""
    from compare.figures.design_drawing import draw_design
    from geometry.cache import cad_files

    chosen, _ = finger.read()
    paths = cad_files(chosen, out, formats=[name.strip() for name in formats.split(",") if name.strip()])
    picture = out / "design.png"
    draw_design(picture, chosen)
    for path in [*paths, picture]:
        print(path)
    return 0
