"""Render a film of the finger with a virtual camera."""

from pathlib import Path
from typing import Annotated

from cyclopts import Group, Parameter
from pydantic import Field

from pinnray.film.rig_settings import RigSettings
from pinnray.options.file import given_options, usual_options
from pinnray.options.shared import OUTPUT, FingerOptions, OptionalOutputPath, PhysicsOptions, SolverOptions
from pinnray.runtime.errors import UserError
from pinnray.vision.rig.exposure import Exposure
from pinnray.vision.rig.motion import Motion

SCENE = Parameter(name="*", group=Group("Scene", sort_key=4), negative="")
EXPOSURE = Parameter(name="*", group=Group("Exposure", sort_key=5))
MOTION = Parameter(name="*", group=Group("Motion", sort_key=6))


class RigOptions(RigSettings):
    """The settings of the rig by the names of options."""

    frame: Annotated[str, Parameter(name="--size")] = Field(
        default="1280x720", description="Width and height of the frames, pixels"
    )


def command(
    *,
    finger: FingerOptions = FingerOptions(),
    physics: PhysicsOptions = PhysicsOptions(),
    options: SolverOptions = SolverOptions(),
    solver: str | None = None,
    scene: Annotated[RigOptions, SCENE] = RigOptions(),
    exposure: Annotated[Exposure, EXPOSURE] = Exposure(),
    motion: Annotated[Motion, MOTION] = Motion(),
    codec: Annotated[str, Parameter(group=OUTPUT, show_default=True)] = "ffv1",
    out: OptionalOutputPath = None,
) -> int:
    """Render a film of a pressed finger, and write the true marker positions beside it.

    Writes a video, the true marker positions and indenter's force in every frame, camera, workspace, and
    photographs of a calibration board with --boards: everything needed to track the markers and to score the
    tracking. Every frame is an equilibrium of the solver. --seed also seeds the noise. Examples:

    - pinnray rig --tilt 3 --noise 2 --blur 0.8 --seed 1
    - pinnray rig --boards 20 --board 9x6 --square 8
    - pinnray rig --moving 0 --codec mjpg --size 640x480

    Args:
        solver: Solver of the filmed displacements; default: the finite-strain simulation of `compare`.
        codec: ffv1 or png (lossless), mjpg or mp4v.
        out: Output folder; default out/rig, unless that holds the finished run of another job.
    """
    from pinnray.camera import rig
    from pinnray.runtime.output_folder import check_same_job

    design, mesh = finger.read(options.preset)
    material, load = physics.read(options.preset)
    solvers = options.read(solver or "")
    if len(solvers) > 1:
        raise UserError("the rig films one finger; name one --solver")
    finger.check_cost(design, mesh, solvers, simulated=not solvers)
    groups, folder = (finger, physics, options, scene, exposure, motion), out or Path("out/rig")
    given = given_options(*groups, solver=solver, codec=codec)
    if out is None:
        check_same_job(folder, given, usual_options(*groups))
    rig(
        design,
        solvers[0] if solvers else None,
        out=folder,
        exposure=exposure,
        motion=motion,
        codec=codec,
        seed=options.seed,
        size=mesh,
        material=material,
        load=load,
        progress=True,
        options=given,
        **dict(scene),
    )
    print(*sorted(folder.iterdir()), sep="\n")
    return 0
