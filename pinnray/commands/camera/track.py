"""Track markers through a video."""

from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Annotated

from cyclopts import Group, Parameter
from rich.console import Console

from pinnray.film.film import FilmSettings
from pinnray.options.file import given_options, usual_options
from pinnray.options.shared import (
    FilmOptions,
    FingerOptions,
    Flag,
    MaterialOptions,
    OptionalOutputPath,
    OutputFlag,
)
from pinnray.runtime.errors import UserError
from pinnray.runtime.exits import say

FORCE = Group("Force", sort_key=5)


def command(
    source: Annotated[str, Parameter(allow_leading_hyphen=True)],
    *,
    finger: FingerOptions = FingerOptions(),
    options: FilmOptions = FilmSettings(),
    force: Annotated[bool, Parameter(group=FORCE, negative="")] = False,
    elastic: Annotated[MaterialOptions, Parameter(name="*", group=FORCE)] = MaterialOptions(),
    learn: Annotated[Path | None, Parameter(group=FORCE, show_default=False)] = None,
    live: Flag = False,
    publish: Flag = False,
    without_video: OutputFlag = False,
    out: OptionalOutputPath = None,
) -> int:
    """Measure marker displacements from a video that shows the finger at rest, pressed, and held.

    Writes the displacements with standard deviations for `compare --measurements`, the trajectory of every
    marker, and annotated pictures to check by eye; with --force also the indenter's force and its place in
    every frame, with intervals. Ctrl-C ends a camera or a pipe. Examples:

    - pinnray track video.mkv --camera camera.json
    - pinnray track frames/ --camera camera.json --workspace workspace.json --design slender
    - pinnray track 0 --camera camera.json --force --young 11.4 --publish

    Args:
        source: Video, folder or glob of pictures, number of a camera, or - for a pipe.
        force: Estimate the indenter's force and its place in every frame; with --live in the newest one. It
            is in proportion to Young's modulus; the markers correct Poisson's ratio. The law is the
            neo-Hookean one unless --law gives one of finite strain. On the way back, and after a hold, its
            interval is wider by --loss.
        learn: Design file to write, .toml, with what the frames with the largest motion say of walls, clamp
            and modulus; --design takes it.
        live: Show the newest force or, without --force, the displacements of every frame as it comes.
        publish: As --live, and write a line of JSON for every frame, with the newest force if --force, to the
            standard output; tables then go to standard error.
        without_video: Write no annotated video.
        out: Output folder; default out/track, unless that holds the finished run of another job, or any of a
            camera or a pipe.
    """
    from pinnray.film.force_estimate import (
        MESH,
        force_table,
        force_tracker,
        forces_of,
        loss_remark,
        write_forces,
    )
    from pinnray.film.live_force import LiveForce, frame_lines
    from pinnray.film.track_film import track_film, track_table
    from pinnray.geometry.cache import finger_mesh
    from pinnray.geometry.drawing.drawn_finger import finger_lines
    from pinnray.geometry.finger.learned import check_target, write_learned
    from pinnray.runtime.machine import machine, package_versions
    from pinnray.runtime.output_folder import check_output, check_same_job, replaced_folder, write_run
    from pinnray.runtime.stages import Stages
    from pinnray.solvers.registry import make_solver

    if (elastic.model_fields_set or learn) and not force:
        raise UserError(f"--{min(elastic.model_fields_set, default='learn')} is for --force")
    if learn is not None:
        check_target(learn)
    (design, settings), learned = finger.read(usual=MESH), finger.learned()
    film, material = options.of(source), elastic.made() if force else None
    if material:
        finger.check_cost(design, settings, [make_solver("fem-id")])
    groups, chosen = (finger, options, elastic), {"source": source, "force": force, "live": live or publish}
    given, folder = given_options(*groups, **chosen), out or Path("out/track")
    if film.live:
        given["recorded"] = datetime.now().astimezone().isoformat()
    if out is None:
        check_same_job(folder, given, usual_options(*groups))
    check_output(folder)
    console, live = Console(stderr=True), live or publish
    forces, passed_over = [], None
    with replaced_folder(folder) as unfinished:
        with Stages(console) as stages:
            following = tracker = None
            if material:
                with stages.stage("mesh"):
                    mesh = finger_mesh(design, settings=settings)
                tracker_of = partial(force_tracker, mesh, design, material, learned=learned)
                if live:
                    tracker = tracker_of(design.markers, plane=film.simulated)
                    following = LiveForce(tracker, design.depth, material.loss)
            watch = frame_lines(following, publish=publish) if live else None
            with stages.stage("track") as report:
                video = not without_video
                tracking, seen, _ = track_film(film, design, unfinished, report, video=video, watch=watch)
            if following is not None:
                forces, passed_over = following.finished(), following.passed_over
            elif material:
                with stages.stage("force") as report:
                    tracker = tracker_of(seen.points, plane=seen.plane)
                    forces = forces_of(tracking, tracker, material.loss, report)
        made = {"versions": package_versions(), "machine": machine()}
        provenance = {"options": given, "design": design.definition(), **made}
        if tracker is not None and material:
            write_forces(unfinished, forces, design.depth)
            provenance["force"] = {
                "material": material.model_dump() | {"law": tracker.law},
                "learned": learned and learned.model_dump(),
                "mesh": settings and settings.model_dump(),
                "frames": len(forces),
                "passed_over": passed_over,
            }
            if learn is not None and tracker.learned is not None:
                write_learned(learn, tracker.learned, finger_lines(design))
        write_run(unfinished, provenance | {"seconds": stages.seconds})
    for warning in tracking.warnings:
        say(f"warning: {warning}")
    said = console if publish else Console()
    said.print(track_table(tracking, seen))
    if forces and material:
        said.print(force_table(forces, design.depth, material.loss, passed_over))
        if not material.loss and (remark := loss_remark(forces, 0.0)):
            say(f"warning: {remark}")
    print(*sorted(folder.iterdir()), sep="\n", file=said.file)
    return 0
