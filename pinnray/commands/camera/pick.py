"""Pick the colour of the markers."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pinnray.options.shared import OutputPath
from pinnray.runtime.errors import UserError


def command(
    source: Annotated[str, Parameter(allow_leading_hyphen=True)],
    *,
    at: str | None = None,
    colour: str | None = None,
    frame: int = 0,
    out: OutputPath = Path("out/pick.png"),
) -> int:
    """Measure the colour of the markers at a point in one of them.

    Prints the colour as --colour takes it, and writes a picture with all pixels of this colour in magenta.

    Args:
        source: Picture, video, folder or glob of pictures, number of a camera, or - for a pipe.
        at: Point X,Y in a marker, pixels.
        colour: Colour to show instead: dark, or L*,L*:a*,a*:b*,b* as printed.
        frame: Number of the frame, from 0.
        out: Output picture.
    """
    from pinnray.vision.discs.circle_proposals import highlight_colour
    from pinnray.vision.discs.colour import read_colour
    from pinnray.vision.discs.colour_picker import pick_colour
    from pinnray.vision.frames.pictures import SUFFIXES, write_picture
    from pinnray.vision.frames.sources import open_frames

    if out.suffix.lower() not in SUFFIXES:
        raise UserError(f"--out {out}: give the name of a picture, such as pick.png")
    if (at is None) == (colour is None):
        raise UserError("give either --at X,Y or --colour")
    place = [] if at is None else read_numbers("--at", at, counts=(2,))
    with open_frames(source) as frames:
        image = next((found.image for found in frames if found.number == frame), None)
        if image is None:
            raise UserError(f"{source} has no frame {frame}")
    chosen = read_colour(colour) if colour is not None else pick_colour(image, place)
    picture, share = highlight_colour(image, chosen)
    write_picture(out, picture)
    print(f"--colour {chosen}")
    print(f"{share:.2%} of the image")
    print(out)
    return 0


def read_numbers(option: str, text: str, *, counts: tuple[int, ...]) -> list[float]:
    """Numbers with commas between them; `counts` are the allowed numbers of numbers."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in counts:
        raise UserError(
            f"{option} {text!r}: give {' or '.join(map(str, counts))} numbers with commas between"
        )
    return numbers
