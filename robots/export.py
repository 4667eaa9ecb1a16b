"""The export of a finger to a robot simulator: its models, their score, and their files."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.robots.chain import MM, Chain
from pinnray.robots.export_settings import ExportSettings, Kind
from pinnray.robots.mjcf import CLEARANCE, chain_mjcf, flex_mjcf, gripper_mjcf, with_header
from pinnray.robots.presses import PressedFinger, press
from pinnray.robots.score import ModelScore, scored
from pinnray.robots.simulation import Model, chain_front, check_mujoco, flex_front
from pinnray.robots.solid_files import write_material, write_solid
from pinnray.robots.solid_mesh import SolidMesh
from pinnray.robots.springs import fitted_springs
from pinnray.runtime.atomic import write_json, write_text
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
        scores: Of the models, if they were scored.
        remarks: What to know about them, a line each.
    """

    files: tuple[Path, ...]
    scores: tuple[ModelScore, ...] = ()
    remarks: tuple[str, ...] = ()


def export_finger(
    kind: Kind, problem: Problem, out: Path, settings: ExportSettings, stages: Stages
) -> Exported:
    """Write a finger's models for a simulator.

    Args:
        kind: `mujoco`: a chain of hinges and a flexible body, both fitted; `mesh`: tetrahedra, their surface
            and the material.
        problem: The finger with its material and, for `mujoco`, the cylinder with its largest travel.
        out: Output folder.
        settings: How.
        stages: Shows the progress.

    Raises:
        UserError: If MuJoCo is missing, or a load is not possible.
    """
    if out.is_file():
        raise UserError(f"{out} is a file; name a folder")
    if kind == "mujoco":
        check_mujoco()
    finger, material = problem.finger, problem.material
    if finger is None:
        raise UserError("a robot model is of a finger; give a problem that has one")
    density = 1000 * (material.substance.density if material.substance else DENSITY)
    with stages.stage("tetrahedra"):
        length = float(np.ptp(finger.section.bounds[:, 0]))
        coarse = MeshSettings(size=min(20.0, length / COARSE))
        body = SolidMesh.of(finger_mesh(finger, settings=coarse, across=settings.across), settings.layers)
    if kind == "mujoco":
        return _mujoco(problem, finger, density, body, out, settings, stages)
    files = *write_solid(out, body), out / "material.json"
    write_material(files[-1], material, density, settings.loss_factor)
    return Exported(files)


def _mujoco(
    problem: Problem,
    finger: Finger,
    density: float,
    body: SolidMesh,
    out: Path,
    settings: ExportSettings,
    stages: Stages,
) -> Exported:
    """Fit and write the chain and the flexible body."""
    with stages.stage("loads") as report:
        pressed = press(problem, report, scored=settings.score, places=settings.places)
    rest, depth, name = MM * pressed.front, finger.depth, finger.name
    with stages.stage("fit"):
        chain = Chain.of(problem.mesh, pressed.front, settings.hinges, density)
        springs = fitted_springs(chain, pressed, fastest=FASTEST)
        damping = settings.loss_factor / float(springs.frequencies[0])  # of the first vibration
        wall = thinnest_wall(finger.section)
        hinges = chain_mjcf(name, chain, springs, wall, depth, settings.loss_factor)

        def flexible(factor: float) -> Model:
            scaled = problem.material.model_copy(update={"young": factor * problem.material.young})
            return Model("flex", flex_mjcf(name, body, scaled, density, damping), flex_front(body, rest))

        tried = scored(flexible(1.0), pressed, pressed.full[1::2])
        factor = float(np.mean([1 / (1 + each.force_error) for each in tried.presses]))
    if not tried.steady or not 0 < factor < np.inf:
        raise UserError("the flexible body does not come to rest; take a smaller stroke, or more layers")
    models = [Model("chain", hinges, chain_front(chain, rest)), flexible(factor)]
    scores: list[ModelScore] = []
    if settings.score:
        with stages.stage("score"):
            scores = [scored(model, pressed, pressed.held_out) for model in models]
    fits = (f"Springs of {settings.hinges} hinges", f"Young's modulus, {factor:.3g} times the material's,")
    files = []
    for number, (model, fit) in enumerate(zip(models, fits, strict=True)):
        said = f"Score: {scores[number].sentence}." if scores else "Not scored: export with the option score."
        files.append(out / f"{model.name}.xml")
        write_text(files[-1], with_header(model.text, [*_header(pressed, fit, settings), said]))
    files.append(out / "gripper.xml")
    write_text(files[-1], _gripper(pressed, models[0].name))
    if scores:
        files += [out / "score.json", out / "score.csv"]
        document = {
            "schema": 1,
            "finger": finger.definition(),
            "material": pressed.problem.material.model_dump(),
            "density_kg_per_m3": density,
            "load": pressed.problem.load.model_dump(),
            "loss_factor": settings.loss_factor,
            "flex_young_factor": factor,
            "fitted_loads": len(pressed.fitted),
            "lost_loads": list(pressed.lost),
            "models": {each.model: each.document() for each in scores},
        }
        write_json(files[-2], document)
        write_csv(files[-1], [{"model": s.model, **each.row()} for s in scores for each in s.presses])
    return Exported(tuple(files), tuple(scores), pressed.lost)


def _gripper(pressed: PressedFinger, model: str) -> str:
    """A scene of two chains around the load's cylinder; their bases do not meet."""
    mesh, stroke = pressed.problem.mesh, -float(pressed.problem.load.values[1])
    place = np.array([mesh.points[mesh.contact_node, 0], pressed.front[:, 1].max()])
    closed = min(stroke, 0.9 * pressed.radius)
    said = [
        f"Two fingers of {model}.xml around a free cylinder as dense as water, with MuJoCo's friction of 1.",
        f"Controls left and right close them: from 0 to {MM * (closed + CLEARANCE):g}, {closed:g} mm beyond "
        "the first touch.",
        "The time step is 0.5 ms: of 1 ms, a held object may be unstable.",
    ]
    scene = gripper_mjcf("gripper", f"{model}.xml", place, pressed.radius, mesh.depth, closed)
    return with_header(scene, said)


def _header(pressed: PressedFinger, fit: str, settings: ExportSettings) -> Sequence[str]:
    problem = pressed.problem
    name = problem.finger.name if problem.finger else ""
    material, stroke = problem.material, -float(problem.load.values[1])
    return [
        f"Finger {name} for MuJoCo 4, by pinnray export. Units: m, kg, s, N, rad.",
        "Frame: x from the base to the tip, y out of the front face, z along the depth; the base is held.",
        f"{fit} fitted to fem-nonlinear ({material.law}, E = {material.young:g} MPa, nu = "
        f"{material.poisson:g}) under a cylinder of radius {pressed.radius:g} mm without friction, up to a "
        f"stroke of {stroke:g} mm, beyond which it is not known.",
        f"Plane strain: a force is N/mm times the depth of {problem.mesh.depth:g} mm. Gravity is off.",
        f"Damping is not fitted: a loss factor of {settings.loss_factor:g} is stated.",
        "Attached to another model, whose time step holds, give that one at most 1 ms: MuJoCo's 2 ms make it "
        "unstable.",
    ]
