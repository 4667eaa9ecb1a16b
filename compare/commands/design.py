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

    With --section, the picture shows what was read and proposed, and a .toml file has the clamp, the contact
    and the markers as lines to change.

    Args:
        out: Output folder.
        formats: File formats, separated by commas: step, stl, dxf, svg.
    """
    from compare.figures.design_drawing import draw_design
    from geometry.atomic import atomic_path
    from geometry.cache import cad_files
    from geometry.drawing.drawn_finger import DrawnFinger, description_lines
    from geometry.finger.design import Design

    chosen, _ = finger.read()
    paths = cad_files(chosen, out, formats=comma_list(formats))
    if isinstance(chosen, DrawnFinger):
        lines = out / f"{chosen.name}.toml"
        with atomic_path(lines) as partial:
            partial.write_text(description_lines(chosen), encoding="utf-8")
        paths.append(lines)
    drawn = draw_design(chosen) if isinstance(chosen, Design) else chosen.plot()
    picture = drawn.save(out / "design.png")
    for path in [*paths, picture]:
        print(path)
    return 0
