"""Track markers through a video."""

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from rich.console import Console
from rich.live import Live

from compare.commands.camera_options import FilmOptions
from compare.commands.options import FingerOptions, Flag, OutputFlag, OutputPath
from compare.runtime.exits import say


def track(
    source: Annotated[str, Parameter(allow_leading_hyphen=True)],
    finger: FingerOptions = FingerOptions(),
    options: FilmOptions = FilmOptions(),
    *,
    live: Flag = False,
    without_video: OutputFlag = False,
    out: OutputPath = Path("out/track"),
) -> int:
    """Measure marker displacements from a video that shows the finger at rest, pressed, and held.

    Writes the displacements with standard deviations for `compare --measurements`, the trajectory of every
    marker, and annotated pictures to check by eye. Ctrl-C ends a camera or a pipe. Examples:

    - pinnray track video.mkv --camera camera.json
    - pinnray track frames/ --camera camera.json --workspace workspace.json --design slender
    - pinnray track 0 --camera camera.json --live

    Args:
        source: Video, folder or glob of pictures, number of a camera, or - for a pipe.
        live: Show the displacements of every frame as it comes.
        without_video: Write no annotated video.
        out: Output folder.
    """
    from compare.camera.track_film import displacement_line, track_film, track_table
    from compare.runtime.output_folder import check_output, replaced_folder, write_run
    from compare.runtime.provenance import machine, package_versions
    from compare.runtime.stages import Stages

    design, _ = finger.read()
    film = options.film(source)
    check_output(out)
    console = Console(stderr=True)
    with replaced_folder(out) as folder:
        with Stages(console, quiet=live) as stages, ExitStack() as stack:
            line = stack.enter_context(Live(console=console, refresh_per_second=10)) if live else None
            watch = displacement_line(line) if line else None
            report = stack.enter_context(stages.stage("track"))
            tracking, observations = track_film(
                film, design, folder, report, video=not without_video, watch=watch
            )
        provenance = {"design": design.definition(), "versions": package_versions(), "machine": machine()}
        write_run(folder, provenance | {"seconds": stages.seconds})
    for warning in tracking.warnings:
        say(f"warning: {warning}")
    Console().print(track_table(tracking, observations))
    for path in sorted(out.iterdir()):
        print(path)
    return 0
