"""The application of the command line with every command."""

from inspect import cleandoc
from pathlib import Path

from cyclopts import App
from docstring_parser.attrdoc import AttributeDocstrings

from pinnray.commands.launch import EPILOGUE
from pinnray.options.file import take_options
from pinnray.runtime.machine import program_version

COMMANDS = (
    *("comparison.compare", "comparison.report"),
    *("finger.design", "finger.mesh", "finger.material", "finger.solve"),
    *("finger.export", "studies.sweep", "studies.predict", "studies.explore"),
    *("studies.optimise", "studies.crossval", "studies.benchmark", "comparison.solvers"),
    *("camera.fiducials", "camera.calibrate", "camera.pick", "camera.points", "camera.rig", "camera.track"),
)
"""Modules of this package with a function `command`; each is imported when its command is asked for."""


AttributeDocstrings.get_attr_docs = lambda *_: {}  # type: ignore[method-assign]
"""No option has a docstring below it: to look for some in pydantic's sources would double `--help`'s time."""


def described(module: str) -> str:
    """The docstring of a module's `command`, out of its source: to import all of them would take a second."""
    source = Path(__file__).parent.joinpath(*module.split(".")).with_suffix(".py").read_text(encoding="utf-8")
    return cleandoc(source.partition("\ndef command(")[2].split('"""', maxsplit=2)[1])


pinnray = App(
    name="pinnray",
    version=program_version,
    version_format="plaintext",
    help="Can a physics-informed neural network stand in for finite elements on a real Fin Ray finger?",
    help_epilogue=EPILOGUE,
    help_format="plaintext",  # Markdown would cost a third of the start
    result_action="return_value",
    suppress_keyboard_interrupt=False,
)
for module in COMMANDS:
    name = module.rpartition(".")[2]
    pinnray.command(
        f"{__package__}.{module}:command",
        name=name,
        help=described(module),
        help_format="markdown",
        help_epilogue=EPILOGUE,
        version=program_version,
        config=take_options if name == "compare" else None,
    )
pinnray.register_install_completion_command(help="Install the completion of commands and options in a shell.")
