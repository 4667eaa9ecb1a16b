"""Models of a finger for robot simulators."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pinnray.options.shared import FingerOptions, OutputPath, PhysicsOptions
from pinnray.robots.export_settings import ExportSettings, Kind
from pinnray.runtime.exits import NOT_CONVERGED, say


def command(
    kind: Kind,
    *,
    finger: FingerOptions = FingerOptions(),
    physics: PhysicsOptions = PhysicsOptions(),
    settings: Annotated[ExportSettings, Parameter(name="*", negative="")] = ExportSettings(),
    out: OutputPath = Path("out/export"),
) -> int:
    """Write a finger for MuJoCo or any program that reads tetrahedra, in SI units.

    mujoco: a chain of hinges and a flexible body, both fitted to fem-nonlinear under a cylinder at several
    places, up to --stroke, and a gripper of two chains around it; the default --mesh-size is 1. mesh:
    tetrahedra, their surface, and the material.

    Args:
        kind: Program: mujoco, or mesh for others.
        out: Output folder.
    """
    from pinnray.robots.export import SIZES
    from pinnray.simulators import export
    from pinnray.solvers.registry import make_solver

    chosen, mesh = finger.read(usual=SIZES)
    material, load = physics.read(usual_load="cylinder")
    finger.check_cost(chosen, mesh, [make_solver("fem-nonlinear")] if kind == "mujoco" else [])
    done = export(
        kind, chosen, out=out, size=mesh, material=material, load=load, progress=True, **dict(settings)
    )
    for each in done.scores:
        print(f"{each.model}: {each.sentence}")
    print(*done.files, sep="\n")
    if unsteady := [each.model for each in done.scores if not each.steady]:
        say(f"warning: {' and '.join(unsteady)} did not come to rest at every load")
        return NOT_CONVERGED
    return 0
