"""Designs from presets and TOML files, with single parameters changed."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.learned import TABLE
from pinnray.geometry.finger.parameters import (
    SYMBOLS,
    Parameters,
    by_parameter_name,
    unknown_parameter,
    with_symbol,
)
from pinnray.runtime.errors import UserError
from pinnray.runtime.text_files import read_toml

FOLDER = Path(__file__).parent.parent / "designs"
"""Folder of the presets, one TOML file each."""


def preset_names() -> list[str]:
    """Names of the presets, `default` first."""
    names = sorted(path.stem for path in FOLDER.glob("*.toml"))
    return sorted(names, key=lambda name: name != "default")


def load_design(
    name_or_path: str | Path = "default", overrides: Mapping[str, Any] | None = None, **parameters: Any
) -> Design:
    """A preset, or the design in a TOML file, with some parameters changed: `load_design(rib_count=6)`.

    Args:
        name_or_path: Name of a preset, or path of a TOML file that gives parameters by name or symbol; those
            it leaves out have their default value. Without `name`, the file's name is the design's.
        overrides: Parameters by name or symbol; values may be text, as from a command line.
        parameters: The same as keywords.

    Raises:
        UserError: If there is no such preset or file, it cannot be read, or the design breaks a rule.
    """
    if not isinstance(overrides, Mapping | None):
        raise UserError(
            f"the changes of a design are a dictionary such as {{'rib_count': 6}}, not {overrides!r}"
        )
    if twice := sorted((overrides or {}).keys() & parameters.keys()):
        raise UserError(f"{with_symbol(twice[0])} is given twice; give it once")
    path = _path_of(name_or_path)
    values = by_parameter_name(read_toml(path, "design file"))
    values.pop(TABLE, None)  # for `read_learned`
    changes = by_parameter_name({**(overrides or {}), **parameters})
    try:
        return Design(**{"name": path.stem, **values, **changes})
    except UserError as error:
        raise UserError(f"design {str(name_or_path)!r}: {error}") from None


def parse_overrides(settings: Sequence[str]) -> dict[str, Any]:
    """Parse texts such as `rib_count=6` or `N=6` into overrides for `load_design`.

    `none` restores the default of `contact_position`, `rib_start` and `rib_pitch`.

    Raises:
        UserError: If a text is no assignment, or names an unknown parameter or one twice.
    """
    overrides: dict[str, Any] = {}
    for name, value in assignments(settings).items():
        if name not in Parameters.model_fields:
            raise UserError(unknown_parameter(name, Parameters))
        optional = Parameters.model_fields[name].default is None
        overrides[name] = None if optional and value.lower() == "none" else value
    return overrides


def assignments(settings: Sequence[str]) -> dict[str, str]:
    """Values by the names of parameters, from texts such as `rib_count=6` or `N=6`.

    Raises:
        UserError: If a text is no assignment, or names a parameter twice.
    """
    found: dict[str, str] = {}
    for setting in settings:
        key, equals, value = (part.strip() for part in setting.partition("="))
        if not (equals and key and value):
            raise UserError(f"cannot read {setting!r}; write parameter=value, such as rib_count=6")
        if (name := SYMBOLS.get(key, key)) in found:
            raise UserError(f"{with_symbol(name)} is set twice; set it once")
        found[name] = value
    return found


def _path_of(name_or_path: str | Path) -> Path:
    """The TOML file of a preset's name or of a path."""
    if not isinstance(name_or_path, str | Path):
        raise UserError(
            f"{name_or_path!r} is no design; give the name of a preset or the path of a .toml file"
        )
    path = Path(name_or_path)
    if path.suffix == ".toml" or isinstance(name_or_path, Path) or len(path.parts) > 1:
        if not path.is_file():
            raise UserError(f"there is no design file {path}; the presets are {', '.join(preset_names())}")
        return path
    if name_or_path not in preset_names():
        raise UserError(
            f"there is no design {name_or_path!r}; the presets are {', '.join(preset_names())}, "
            "or give the path of a .toml file"
        )
    return FOLDER / f"{name_or_path}.toml"
