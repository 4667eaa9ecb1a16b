"""Displacements from points that were clicked in two photographs."""

from pathlib import Path
from typing import cast, get_args

from pinnray.commands.camera.pick import read_numbers
from pinnray.options.shared import FingerOptions, OutputPath
from pinnray.runtime.errors import UserError
from pinnray.runtime.exits import say


def command(
    rest: Path,
    pressed: Path,
    *,
    finger: FingerOptions = FingerOptions(),
    scale: str = "same",
    out: OutputPath = Path("out/observations.csv"),
) -> int:
    """Make measurements of points that were clicked in two photographs, at rest and pressed.

    Each list is a CSV file with the columns x and y, in pixels or any other unit, a row a marker, in the
    order of the design's markers or at least both in one order; y may run up or down. With a column point,
    rows of one number are repeats. Another order of the pressed points and missing ones are told. Writes
    displacements for `compare --measurements`. Examples:

    - pinnray points rest.csv pressed.csv --section finger.svg
    - pinnray points rest.csv pressed.csv --section finger.svg --scale lengths

    Args:
        rest: Clicks in the picture at rest.
        pressed: Clicks in the picture of the pressed finger.
        scale: same: both pictures have the scale that fits the drawing at rest; lengths: each has the scale
            at which the lines between successive points are as long as on the drawing, as along walls; or
            millimetres per unit of both pictures, such as 0.21,0.22.
        out: Output file.
    """
    from pinnray.vision.clicked_points import LengthScale, clicked_points, read_clicks
    from pinnray.vision.measurements import write_measurements

    design, _ = finger.read()
    if out.suffix.lower() != ".csv":
        raise UserError(f"--out {out}: give the name of a table, such as observations.csv")
    chosen: LengthScale | tuple[float, float]
    if scale in get_args(LengthScale):
        chosen = cast(LengthScale, scale)
    else:
        given = read_numbers("--scale", scale, counts=(1, 2))
        if not all(0 < each < 1e6 for each in given):
            raise UserError(f"--scale {scale}: give same, lengths, or millimetres per unit such as 0.21,0.22")
        chosen = given[0], given[-1]
    found = clicked_points(
        read_clicks(rest),
        read_clicks(pressed),
        design.markers,
        marker_radius=design.marker_radius,
        scale=chosen,
        source=f"points clicked in two photographs, {rest.name} and {pressed.name}",
    )
    out.parent.mkdir(parents=True, exist_ok=True)
    write_measurements(out, found.observations)
    one, two = found.scales
    print(f"scale {one:.5g} mm per unit at rest, {two:.5g} pressed" + (", y down" if found.mirrored else ""))
    for remark in found.remarks:
        say(f"warning: {remark}")
    if found.reordered:
        print("the points are in another order than the markers: each was given the nearest one")
    print(f"{found.misfit:.2g} mm from the drawing at rest (rms of a coordinate)")
    print(f"a clicked coordinate is known to {found.noise:.2g} mm, by {found.reason}")
    print(f"how the pressed picture lies is not known: {found.observations.pressed}")
    print(out)
    return 0
