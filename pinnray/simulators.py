"""Function of the front door for robot simulators: export."""

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pinnray.arguments import mesh_settings, read_job, taken
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.robots.export_settings import KINDS, ExportSettings, Kind
from pinnray.runtime.errors import UserError
from pinnray.runtime.text_files import as_path
from pinnray.solvers.load import Load, LoadKind
from pinnray.solvers.material import Material

if TYPE_CHECKING:
    from pinnray.robots.export import Exported


def export(
    kind: Kind,
    design: str | Path | Finger = "default",
    *,
    out: str | Path,
    size: float | MeshSettings | None = None,
    material: Material | str | None = None,
    load: Load | LoadKind | None = "cylinder",
    progress: bool | None = None,
    **given: Any,
) -> "Exported":
    """Write a finger for a robot simulator, in SI units: `export("mujoco", out="model", score=True)`.

    Warns of loads that `fem-nonlinear` did not reach.

    Args:
        kind: `mujoco`: a chain of hinges and a flexible body, both fitted to `fem-nonlinear` under a cylinder
            at several places, up to the stroke, and a gripper of two chains; `mesh`: tetrahedra, their
            surface, and the material.
        design: A finger in one of the ways of `mesh`.
        out: Output folder.
        size: Largest element of `fem-nonlinear` in walls and ribs, mm; 1 if None.
        material: See `solve`.
        load: See `solve`; a cylinder.
        progress: Whether to show the stages; if None in a notebook only.
        given: Settings by the words of `pinnray.robots.export_settings.ExportSettings`: `hinges`,
            `loss_factor`, `across`, `layers`, `places`, `score`; parameters of finger, material and load.

    Raises:
        UserError: If MuJoCo is missing, or a load is not possible.
    """
    from pinnray.geometry.cache import finger_mesh, mesh_sizes
    from pinnray.robots.export import SIZES, export_finger
    from pinnray.runtime.stages import shown_stages
    from pinnray.solvers.problem import Problem

    if kind not in KINDS:
        raise UserError(f"there is no export {kind!r}; there are {', '.join(KINDS)}")
    settings = ExportSettings(**taken(given, ExportSettings))
    if settings.score and kind != "mujoco":
        raise UserError(f"score is of mujoco; no score is made for {kind}")
    words = ("size", "material", "load", *ExportSettings.model_fields)
    finger, elastic, moved = read_job(design, material, load, given, besides=words)
    with shown_stages(progress) as stages:
        with stages.stage("mesh"):
            triangles = finger_mesh(finger, settings=mesh_sizes(finger, mesh_settings(size), SIZES))
        problem = Problem(triangles, elastic, moved, None, finger)
        done = export_finger(kind, problem, as_path(out, "out"), settings, stages)
    for remark in done.remarks:
        warnings.warn(remark, stacklevel=2)
    return done
