"""Reads arguments of the front door: fingers, material, load and solvers in the user's words."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel

from pinnray.geometry.cache import drawn_finger
from pinnray.geometry.drawing.description import (
    DRAWINGS,
    Description,
    description_beside,
    load_description,
)
from pinnray.geometry.drawing.drawn_finger import DrawnFinger
from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.finger.learned import Learned, read_learned
from pinnray.geometry.finger.parameters import SYMBOLS, Parameters, by_parameter_name, unknown_parameter
from pinnray.geometry.finger.presets import load_design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.options.solver_choice import made_solvers
from pinnray.runtime.errors import UserError
from pinnray.runtime.text_files import as_path
from pinnray.solvers.load import Load, LoadKind, Physics
from pinnray.solvers.material import Material
from pinnray.solvers.materials.presets import of_preset
from pinnray.solvers.registry import PRESETS
from pinnray.solvers.solver import Solver

MATERIAL = tuple(Material.model_fields)


def taken(given: dict[str, Any], model: type[BaseModel]) -> dict[str, Any]:
    """The words that are fields of a model, which are removed from those given."""
    return {name: given.pop(name) for name in model.model_fields if name in given}


def read_job(
    design: object,
    material: Material | str | None,
    load: Load | LoadKind | None,
    given: Mapping[str, Any],
    besides: Sequence[str] = (),
    allowed: Sequence[str] = tuple(Physics.model_fields),
) -> tuple[Finger, Material, Load]:
    """Finger, material and load.

    Args:
        design: A finger, the name of a preset, or a file.
        material: The elastic constants, if they are not among the words, or the name of a known material.
        load: The load, or its kind if its numbers are among the words.
        given: Parameters of the finger, the material and the stroke, by name or symbol.
        besides: Further words of the function, for the message on an unknown one.
        allowed: Words of material and load that the function takes.

    Raises:
        UserError: If a word is unknown, or says again what `material` or `load` says.
    """
    words = by_parameter_name(given, Physics)
    own = [name for name in words if SYMBOLS.get(name, name) in Parameters.model_fields]
    shape = {name: words.pop(name) for name in own}
    for name in words:
        if name not in allowed:
            raise UserError(unknown_parameter(name, Parameters, besides=(*allowed, *besides)))
    constants = taken(words, Material)
    if isinstance(material, str):
        material, constants = of_preset(material, **constants), {}
    if constants and material is not None:
        raise UserError(f"{next(iter(constants))} is part of the material that is given; change it there")
    if words and isinstance(load, Load):
        raise UserError(f"{next(iter(words))} is part of the load that is given; change it there")
    if material is not None and not isinstance(material, Material):
        raise UserError(f"material must be a Material, such as pr.Material(young=5), not {material!r}")
    if not isinstance(load, Load):
        if not isinstance(load, str | None):
            raise UserError(f"load must be a Load or one of {', '.join(get_args(LoadKind))}, not {load!r}")
        load = Physics(load=load or "mean", **words).parts[1]
    return read_finger(design, shape), material or Material(**constants), load


def read_finger(design: object, shape: Mapping[str, Any] | None = None) -> Finger:
    """A finger, of which some parameters are changed.

    Raises:
        UserError: If there is no such finger, or a drawing's parameter is to be changed.
    """
    shape = shape or {}
    if isinstance(design, str | Path) and Path(design).suffix.lower() not in DRAWINGS:
        return load_design(design, shape)
    if isinstance(design, Design):
        return design.replaced(**shape) if shape else design
    if isinstance(design, str | Path):
        design = given_drawing(design)
    if not isinstance(design, DrawnFinger):
        raise UserError(f"{design!r} is no design; give a finger, the name of a preset or a file")
    if shape:
        raise UserError(f"{next(iter(shape))} is a parameter of a design, and {design.name} is a drawing")
    return design


def learned_of(design: object) -> Learned | None:
    """What a design's file, or the description beside a drawing, says that pictures have taught of it."""
    if not isinstance(design, str | Path):
        return None
    path = Path(design)
    return read_learned(description_beside(path) if path.suffix.lower() in DRAWINGS else path)


def given_drawing(file: str | Path, description: Mapping[str, Any] | None = None) -> DrawnFinger:
    """The finger of a drawing; see `pinnray.functions.load_drawing`."""
    path = as_path(file, "the drawing")
    known = load_description(description_beside(path)).model_dump(exclude_none=True)
    return drawn_finger(path, Description(**{**known, **(description or {})}))


def read_solvers(given: object, preset: str | None = None) -> list[Solver]:
    """Solvers, one or several, by their names or made; a preset is for those that have it.

    Raises:
        UserError: If there is no such solver, or none that is named has the preset.
    """
    if isinstance(given, str):
        given = [name.strip() for name in given.split(",")]
    several: list[Any] = list(given) if isinstance(given, Sequence) else [given]
    for each in several:
        if not isinstance(each, str) and (isinstance(each, type) or not isinstance(each, Solver)):
            raise UserError(
                f"{each!r} is no solver; give one that is made, such as pr.solver('fem'), or its name"
            )
    named = iter(made_solvers([each for each in several if isinstance(each, str)], preset))
    return [next(named) if isinstance(each, str) else each for each in several]


def read_solver(given: object, preset: str | None = None) -> Solver:
    """A solver that is made, or by its name; without either `fem` or the one that has the preset.

    Raises:
        UserError: If there is no such solver or preset.
    """
    if given is None:
        given = next((name for name in PRESETS if preset in PRESETS[name]), "fem")
    (solver,) = read_solvers([given], preset)
    return solver


def mesh_settings(size: float | MeshSettings | None) -> MeshSettings | None:
    """Element sizes, by the size in walls and ribs, mm; None if none is given."""
    return size if size is None or isinstance(size, MeshSettings) else MeshSettings(size=size)
