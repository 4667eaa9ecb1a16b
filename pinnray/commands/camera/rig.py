"""Render a film of the finger with a virtual camera."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pinnray.commands.quiet import quietable
from pinnray.options.camera import EXPOSURE, MOTION, BoardOptions, CameraOptions, SceneOptions
from pinnray.options.shared import OUTPUT, FingerOptions, OutputPath, PhysicsOptions, SolverOptions
from pinnray.runtime.errors import UserError
from pinnray.vision.rig.exposure import Exposure
from pinnray.vision.rig.motion import Motion


@quietable
def command(
    finger: FingerOptions = FingerOptions(),
    physics: PhysicsOptions = PhysicsOptions(),
    options: SolverOptions = SolverOptions(),
    *,
    solver: str | None = None,
    lens: CameraOptions = CameraOptions(),
    exposure: Annotated[Exposure, Parameter(name="*", group=EXPOSURE)] = Exposure(),
    motion: Annotated[Motion, Parameter(name="*", group=MOTION)] = Motion(),
    scene: SceneOptions = SceneOptions(),
    boards: BoardOptions = BoardOptions(),
    codec: Annotated[str, Parameter(group=OUTPUT, show_default=True)] = "ffv1",
    out: OutputPath = Path("out/rig"),
) -> int:
    """Render a film of a pressed finger, and write the true marker positions beside it.

    Writes a video, the true marker positions and indenter's force in every frame, camera, workspace, and
    photographs of a calibration board with --boards: everything needed to track the markers and to score the
    tracking. Every frame is an equilibrium of the solver. --seed also seeds the noise. Examples:

    - pinnray rig --tilt 3 --noise 2 --blur 0.8 --seed 1
    - pinnray rig --boards 20 --board 9x6 --square 8
    - pinnray rig --moving 0 --cover 5=0.4 --codec mjpg --size 640x480

    Args:
        solver: Solver of the filmed displacements; default: the finite-strain simulation of `compare`.
        codec: ffv1 or png (lossless), mjpg or mp4v.
        out: Output folder.
    """
    from pinnray.comparison.pipeline.shared_mesh import shared_mesh
    from pinnray.film.filmed_force import filmed_course
    from pinnray.film.virtual_film import filmed_solution, write_film
    from pinnray.runtime.output_folder import check_output
    from pinnray.runtime.stages import Stages
    from pinnray.vision.rig.occluders import cables, check_covers
    from pinnray.vision.rig.recording import Recording
    from pinnray.vision.rig.recording_files import check_codec
    from pinnray.vision.tracking.workspace import default_workspace

    design, mesh_settings = finger.read(options.preset)
    material, load = physics.read(options.preset)
    workspace = default_workspace(design).model_copy(update={"marker_plane": scene.marker_plane})
    camera, pose = lens.read(workspace)
    board, covered = boards.read(), scene.covered()
    check_codec(codec)
    check_output(out)
    solvers = options.read(solver or "")
    if len(solvers) > 1:
        raise UserError("the rig films one finger; name one --solver")
    filmed = solvers[0] if solvers else None
    finger.check_cost(design, mesh_settings, solvers, simulated=filmed is None)
    with Stages() as stages:
        mesh, _ = shared_mesh(design, mesh_settings, stages)
        bench = scene.bench(mesh, design, workspace)
        check_covers(covered, len(mesh.marker_nodes))
        solution, source = filmed_solution(mesh, design, material, load, filmed, stages)
        displacement = solution.displacement(mesh.at_nodes())
        course = filmed_course(solution)
        recording = Recording(
            bench=bench,
            displacement=displacement,
            camera=camera,
            pose=pose,
            exposure=exposure,
            motion=motion,
            occluders=cables(bench, course, motion, covered, scene.cover_during, paint=scene.cover_paint),
            seed=options.seed,
            course=course,
        )
        write_film(
            recording,
            solution,
            out,
            stages,
            source=source,
            codec=codec,
            board=board,
            boards=boards.boards,
            facts={"cover": {"shares": covered, "during": scene.cover_during} if covered else None},
        )
    for path in sorted(out.iterdir()):
        print(path)
    return 0
