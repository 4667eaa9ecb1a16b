"""Reads arguments of the front door: fingers, material, load and solvers in the user's words."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypedDict, get_args

from pinnray.geometry.cache import drawn_finger
from pinnray.geometry.drawing.description import Description, description_beside, load_description
from pinnray.geometry.drawing.drawn_finger import DrawnFinger
from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.finger.keywords import FingerKeywords
from pinnray.geometry.finger.parameters import SYMBOLS, Parameters, by_parameter_name, unknown_parameter
from pinnray.geometry.finger.presets import load_design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.runtime.errors import UserError
from pinnray.runtime.text_files import as_path
from pinnray.solvers.elasticity import LawName
from pinnray.solvers.materials.presets import preset
from pinnray.solvers.physics import Load, LoadKind, Material, Physics
from pinnray.solvers.registry import PRESETS, make_solver, unknown_solver
from pinnray.solvers.solver import Solver

DRAWINGS = (".step", ".stp", ".dxf", ".svg", ".msh")
"""Endings of the files that are read as drawings."""


class PhysicsKeywords(TypedDict, total=False):
    """Material and travel of the indenter, as in `pinnray.solvers.physics.Physics`; each may be left out."""

    young: float
    poisson: float
    plane: Literal["strain", "stress"]
    law: LawName
    stroke: float
    direction: float
    slide: bool
    radius: float | None
    friction: float
    E: float  #: Symbol of `young`
    nu: float  #: Symbol of `poisson`


class JobKeywords(FingerKeywords, PhysicsKeywords, total=False):
    """Parameters of finger, material and load."""


class MeshKeywords(FingerKeywords, total=False):
    """Element sizes, mm, and parameters of the finger."""

    size: float
    coarsening: float
    growth: float
    contact_size: float | None
    corner_size: float | None


class FilmKeywords(TypedDict, total=False):
    """How a film of a finger is read; each may be left out."""

    camera: str | Path | None  #: Camera file, as `calibrate` writes it
    workspace: str | Path | None  #: JSON file of the fiducials; those around the design if None
    colour: str  #: Of the markers, as `pinnray pick` prints it; dark by default
    method: Literal["precise", "hough"]  #: Detection of the discs; `hough` is the paper's pipeline
    fps: float | None  #: Frames a second of pictures, which do not say it; 30 if None


class FilmJobKeywords(JobKeywords, FilmKeywords, total=False):
    """How a film is read, and parameters of its finger and material."""


FILM = tuple(FilmKeywords.__annotations__)
MATERIAL = tuple(Material.model_fields)
LOAD = tuple(name for name in Physics.model_fields if name not in (*MATERIAL, "load"))


SYNONYMS = {**Physics.synonyms, **MeshSettings.synonyms, "solver": "solvers", "solvers": "solver"}
"""Words for those of a job's that are no parameters of a finger, which messages answer with the right one."""


def read_job(
    design: object,
    material: Material | str | None,
    load: Load | LoadKind | None,
    given: Mapping[str, Any],
    besides: Sequence[str] = (),
    allowed: Sequence[str] = (*MATERIAL, *LOAD),
) -> tuple[Finger, Material, Load]:
    """Finger, material and load.

    Args:
        design: A finger, the name of a preset, or a file.
        material: The elastic constants, if they are not among the words, or the name of a known material.
        load: The load, or its kind if its numbers are among the words.
        given: Words of `JobKeywords`.
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
            raise UserError(
                unknown_parameter(name, Parameters, besides=(*allowed, *besides), synonyms=SYNONYMS)
            )
    constants = {name: words.pop(name) for name in MATERIAL if name in words}
    if constants and material is not None:
        raise UserError(f"{next(iter(constants))} is part of the material that is given; change it there")
    if words and isinstance(load, Load):
        raise UserError(f"{next(iter(words))} is part of the load that is given; change it there")
    if isinstance(material, str):
        material = preset(material).material
    if material is not None and not isinstance(material, Material):
        raise UserError(f"material must be a Material, such as pr.Material(young=5), not {material!r}")
    if not isinstance(load, Load):
        if not isinstance(load, str | None):
            raise UserError(f"load must be a Load or one of {', '.join(get_args(LoadKind))}, not {load!r}")
        load = Load(load or "mean", **words)
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


def given_drawing(file: str | Path, description: Mapping[str, Any] | None = None) -> DrawnFinger:
    """The finger of a drawing; see `pinnray.functions.load_drawing`."""
    path = as_path(file, "the drawing")
    known = load_description(description_beside(path)).model_dump(exclude_none=True)
    return drawn_finger(path, Description(**{**known, **(description or {})}))


def read_solver(given: object, preset: str | None = None) -> Solver:
    """A solver that is made, or by its name; without either `fem` or the one that has the preset.

    Raises:
        UserError: If there is no such solver or preset.
    """
    if preset is not None and not any(preset in presets for presets in PRESETS.values()):
        known = "; ".join(f"{name} has {', '.join(presets)}" for name, presets in PRESETS.items())
        raise UserError(f"there is no preset {preset!r}; {known}")
    if given is None:
        given = "fem" if preset is None else next(name for name in PRESETS if preset in PRESETS[name])
    if isinstance(given, str):
        return make_solver(given, **({} if preset is None else {"preset": preset}))
    if isinstance(given, type) or not isinstance(given, Solver):
        raise UserError(
            f"{given!r} is no solver; give one that is made, such as pr.solver('fem'), or its name"
        )
    if preset is not None:
        raise UserError(f"the preset {preset} is chosen when {given.name} is made; give its name instead")
    return given


def read_solvers(given: object, preset: str | None = None) -> list[Solver]:
    """Solvers, one or several; a preset is for those that have it.

    Raises:
        UserError: If there is no such solver, or none has the preset.
    """
    several = list(given) if isinstance(given, Sequence) and not isinstance(given, str) else [given]
    having = [each for each in several if isinstance(each, str) and preset in PRESETS.get(each, ())]
    if preset is not None and not having:
        read_solver(None, preset)  # or says which presets there are
        raise UserError(f"none of the solvers has the preset {preset!r}")
    if any(each is None or each == "" for each in several):
        raise UserError(unknown_solver(None))
    return [read_solver(each, preset if each in having else None) for each in several]


def mesh_settings(size: float | None) -> MeshSettings | None:
    """Element sizes, by the size in walls and ribs, mm; None if none is given."""
    return None if size is None else MeshSettings(size=size)
