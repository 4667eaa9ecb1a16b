"""Models of a finger for robot simulators."""

from dataclasses import replace
from pathlib import Path
from typing import Literal

from rich.console import Console

from pinnray.commands.quiet import quietable
from pinnray.options.shared import FingerOptions, Flag, OutputPath, PhysicsOptions
from pinnray.runtime.exits import NOT_CONVERGED, say


@quietable
def command(
    kind: Literal["mujoco", "sofa", "mesh"],
    finger: FingerOptions = FingerOptions(),
    physics: PhysicsOptions = PhysicsOptions(),
    *,
    hinges: int = 12,
    loss_factor: float = 0.2,
    across: int = 1,
    layers: int = 1,
    places: int = 6,
    score: Flag = False,
    out: OutputPath = Path("out/export"),
) -> int:
    """Write a finger for MuJoCo, SOFA or any program that reads tetrahedra, in SI units.

    mujoco: a chain of hinges and a flexible body, both fitted to fem-nonlinear under a cylinder at several
    places, up to --stroke; the default --mesh-size is 1. sofa: a scene and its mesh. mesh: tetrahedra, their
    surface, and the material.

    Args:
        kind: Program: mujoco, sofa or mesh.
        hinges: Number of hinges of the chain.
        loss_factor: Damping of the material, which is stated and not fitted.
        across: Least number of tetrahedra through a wall: more are less stiff of themselves, and slower.
        layers: Layers of tetrahedra through the depth.
        places: Number of places of the cylinder for the fit.
        score: Press the models of mujoco at ten loads that the fit has not seen, and compare with
            fem-nonlinear.
        out: Output folder.
    """
    from pinnray.comparison.pipeline.shared_mesh import shared_mesh
    from pinnray.robots.export import SIZES, ExportSettings, export_finger
    from pinnray.robots.score import score_table
    from pinnray.runtime.errors import UserError
    from pinnray.runtime.stages import Stages
    from pinnray.solvers.problem import Problem
    from pinnray.solvers.registry import make_solver

    chosen, mesh = finger.read(usual=SIZES)
    if score and kind != "mujoco":
        raise UserError(f"--score is of mujoco; no score is made for {kind}")
    settings = ExportSettings(
        hinges=hinges, loss_factor=loss_factor, across=across, layers=layers, places=places, score=score
    )
    material, load = replace(physics, load=physics.load or "cylinder").read()
    finger.check_cost(chosen, mesh, [make_solver("fem-nonlinear")] if kind == "mujoco" else [])
    with Stages() as stages:
        triangles, _ = shared_mesh(chosen, mesh, stages)
        done = export_finger(kind, Problem(triangles, material, load, None, chosen), out, settings, stages)
    for remark in done.remarks:
        say(f"warning: {remark}")
    if done.scores:
        Console(soft_wrap=True).print(score_table(done.scores))
    for each in done.scores:
        print(f"{each.model}: {each.sentence}")
    for path in done.files:
        print(path)
    if unsteady := [each.model for each in done.scores if not each.steady]:
        say(f"warning: {' and '.join(unsteady)} did not come to rest at every load")
        return NOT_CONVERGED
    return 0
