"""The option --from: options of `compare` out of a file, which may be the `run.json` of an earlier run."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import App, ArgumentCollection

from pinnray.runtime.errors import UserError
from pinnray.runtime.exits import say
from pinnray.runtime.machine import package_versions
from pinnray.runtime.text_files import read_json, read_toml

if TYPE_CHECKING:
    from pydantic import BaseModel

OPTION = "--from"
INPUTS = ("design", "mesh", "measurements")
"""What a run computes from; `run.json` has the SHA-256 of each."""


def take_options(app: App, commands: tuple[str, ...], arguments: ArgumentCollection) -> None:
    """Give every option that the command line leaves out its value in the file of --from, if it has one."""
    files = [token.value for argument in arguments if OPTION in argument.names for token in argument.tokens]
    if files:
        from cyclopts.config import Dict

        content = read_options_file(Path(files[-1]))
        nested = content["options"]
        for command in reversed(commands):
            nested = {command: nested}
        Dict(nested, source=files[-1])(app, commands, arguments)


def read_options_file(file: Path) -> dict[str, Any]:
    """The content of a TOML or JSON file with a table `options`: of a `run.json`, with its provenance.

    Raises:
        UserError: If it cannot be read, has no options, has a key beside them and is not of a run, or names
            an output folder elsewhere: the file may be somebody else's.
    """
    from pinnray.runtime.output_folder import SCHEMA

    is_json = file.suffix.lower() == ".json"
    content = read_json(file, "options file") if is_json else read_toml(file, "options file")
    options = content.get("options") if isinstance(content, dict) else None
    if not isinstance(options, dict):
        raise UserError(f'{file} has no table "options"; one line of it is, for example, mesh-size = 0.5')
    out = options.get("out", "")
    for folder in map(str, out if isinstance(out, list) else [out]):
        if Path(folder).is_absolute() or ".." in Path(folder).parts:
            raise UserError(f"{file}: out = {folder!r} leads out of the working folder; give it as --out")
    if (schema := content.get("schema", SCHEMA)) != SCHEMA:
        raise UserError(f"{file} has schema {schema}; this version of pinn-ray reads schema {SCHEMA}")
    if "files_sha256" not in content and (unknown := sorted({*content} - {"options", "schema"})):
        raise UserError(f'{file}: unknown key {unknown[0]!r}; options belong into its table "options"')
    return content


def given_options(*groups: "BaseModel", **others: object) -> dict[str, object]:
    """The options that are given, by their names on the command line, for `run.json`.

    Args:
        groups: Groups of options.
        others: Options by name; their default is nothing.
    """
    values = {name: value for name, value in others.items() if value}
    for group in groups:
        values |= group.model_dump(mode="json", exclude_unset=True)
    return {name.replace("_", "-"): value for name, value in values.items()}


def usual_options(*groups: "BaseModel") -> dict[str, object]:
    """The defaults of groups of options, by their names on the command line."""
    values = {name: value for each in groups for name, value in type(each)().model_dump(mode="json").items()}
    return {name.replace("_", "-"): value for name, value in values.items()}


def note_versions(file: Path, earlier: Mapping[str, Any]) -> None:
    """Say which packages have another version than in the provenance of an earlier run."""
    then, now = earlier.get("versions", {}), package_versions()
    changed = [
        f"{name} {then[name]} (now {now[name]})" for name in now if then.get(name, now[name]) != now[name]
    ]
    if changed:
        say(f"note: {file} was made with {', '.join(changed)}; the numbers may differ")


def note_inputs(file: Path, earlier: Mapping[str, Any], run: Path) -> None:
    """Say which inputs of a repeated run differ from those of the earlier one.

    Args:
        file: The `run.json` that was repeated.
        earlier: Its content, from before the run.
        run: The `run.json` of the new run.
    """
    new = read_json(run, "provenance")
    if earlier["options"] != new["options"]:
        return
    keys = {name: f"{name}_sha256" for name in INPUTS}
    if changed := [name for name, key in keys.items() if earlier.get(key, new[key]) != new[key]]:
        say(f"note: not the same as in {file}: {', '.join(changed)}")
