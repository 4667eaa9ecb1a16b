"""Draw the finger."""

from pathlib import Path

from compare.commands.options import FingerOptions, OutputPath, comma_list


def design(
    finger: FingerOptions = FingerOptions(),
    *,
    out: OutputPath = Path("out/cad"),
    formats: str = "step,stl,dxf,svg",
) -> int:
    """Draw the finger: CAD files of the body and its markers, and a dimensioned picture.

    Args:
        out: Output folder.
        formats: File formats, separated by commas: step, stl, dxf, svg.
    """
    from compare.figures.design_drawing import draw_design
    from geometry.cache import cad_files

    chosen, _ = finger.read()
    paths = cad_files(chosen, out, formats=comma_list(formats))
    picture = draw_design(chosen).save(out / "design.png")
    for path in [*paths, picture]:
        print(path)
    return 0
