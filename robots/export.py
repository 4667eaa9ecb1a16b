"""The export of a finger to a robot simulator: its models, their score, and their files."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.robots.chain import Chain
from pinnray.robots.export_settings import ExportSettings, Kind
from pinnray.robots.mjcf import chain_mjcf, with_header
from pinnray.robots.presses import PressedFinger, press
from pinnray.robots.score import ModelScore, scored
from pinnray.robots.simulation import check_mujoco
from pinnray.robots.solid_files import write_solid
from pinnray.robots.solid_mesh import SolidMesh
from pinnray.robots.springs import fitted_springs
from pinnray.runtime.atomic import write_text
from pinnray.runtime.errors import UserError
from pinnray.runtime.stages import Stages
from pinnray.runtime.tables import write_csv
from pinnray.solvers.finger_figures.figures import DENSITY
from pinnray.solvers.finger_figures.measures import thinnest_wall
from pinnray.solvers.problem import Problem

SIZES = MeshSettings(size=1.0)
"""Sizes of the elements of `fem-nonlinear`, unless others are asked for."""
FASTEST = 1500.0
"""Largest angular frequency of the chain, rad/s: with it a time step of 1 ms is stable."""
COARSE = 45
"""Length of the finger over the largest side of a tetrahedron in the section."""


@dataclass(frozen=True, eq=False)
class Exported:
    """What an export has written.

    Attributes:
        files: The files.
        score: Of the model, if it was scored.
        remarks: What to know about it, a line each.
    """

    files: tuple[Path, ...]
    score: ModelScore | None = None
    remarks: tuple[str, ...] = ()


def export_finger(
    kind: Kind, problem: Problem, out: Path, settings: ExportSettings, stages: Stages
) -> Exported:
    """Write a finger's models for a simulator.

    Args:
        kind: `mujoco`: a chain of hinges, fitted; `mesh`: tetrahedra and their surface.
        problem: The finger with its material and, for `mujoco`, the cylinder with its largest travel.
        out: Output folder.
        settings: How.
        stages: Shows the progress.

    Raises:
        UserError: If MuJoCo is missing for a score, or a load is not possible.
    """
    if out.is_file():
        raise UserError(f"{out} is a file; name a folder")
    if settings.score:
        check_mujoco()
    finger = problem.finger
    if finger is None:
        raise UserError("a robot model is of a finger; give a problem that has one")
    if kind == "mujoco":
        return _mujoco(problem, finger, out, settings, stages)
    with stages.stage("tetrahedra"):
        length = float(np.ptp(finger.section.bounds[:, 0]))
        coarse = MeshSettings(size=min(20.0, length / COARSE))
        body = SolidMesh.of(finger_mesh(finger, settings=coarse, across=settings.across), settings.layers)
    return Exported(write_solid(out, body))


def _mujoco(
    problem: Problem, finger: Finger, out: Path, settings: ExportSettings, stages: Stages
) -> Exported:
    """Fit and write the chain."""
    density = 1000 * (problem.material.substance.density if problem.material.substance else DENSITY)
    with stages.stage("loads") as report:
        pressed = press(problem, report, scored=settings.score, places=settings.places)
    with stages.stage("fit"):
        chain = Chain.of(problem.mesh, pressed.front, settings.hinges, density)
        springs, wall = fitted_springs(chain, pressed, fastest=FASTEST), thinnest_wall(finger.section)
        text = chain_mjcf(finger.name, chain, springs, wall, finger.depth, settings.loss_factor)
    score, files, said = None, [out / "chain.xml"], "Not scored: export with the option score."
    if settings.score:
        with stages.stage("score"):
            score = scored(text, chain, pressed)
        said = f"Score: {score.sentence}."
        files.append(out / "score.csv")
        write_csv(files[-1], [each.row() for each in score.presses])
    write_text(files[0], with_header(text, [*_header(pressed, settings), said]))
    return Exported(tuple(files), score, pressed.lost)


def _header(pressed: PressedFinger, settings: ExportSettings) -> Sequence[str]:
    problem = pressed.problem
    name = problem.finger.name if problem.finger else ""
    material, stroke = problem.material, -float(problem.load.values[1])
    return [
        f"Finger {name} for MuJoCo, by pinnray export. Units: m, kg, s, N, rad.",
        "Frame: x from the base to the tip, y out of the front face, z along the depth; the base is held.",
        f"Springs of {settings.hinges} hinges fitted to fem-nonlinear ({material.law}, "
        f"E = {material.young:g} MPa, nu = {material.poisson:g}) under a cylinder of radius "
        f"{pressed.radius:g} mm without friction, up to a stroke of {stroke:g} mm; beyond, it is not known.",
        f"Plane strain: a force is N/mm times the depth of {problem.mesh.depth:g} mm. Gravity is off.",
        f"Damping is not fitted: a loss factor of {settings.loss_factor:g} is stated.",
        "Attached to another model, whose time step holds, give that one at most 1 ms: MuJoCo's 2 ms make it "
        "unstable.",
    ]
