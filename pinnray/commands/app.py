"""The application of the command line with every command."""

from cyclopts import App

from compare.runtime.provenance import program_version
from pinnray.commands.camera import calibrate, fiducials, pick, points, rig, track
from pinnray.commands.comparison import compare, crossval, report, solvers
from pinnray.commands.finger import design, export, material, mesh, sensitivity, solve
from pinnray.commands.launch import EXIT_CODES
from pinnray.commands.quiet import quietable
from pinnray.commands.studies import app, explore, gridsearch, optimise, predict, sweep
from pinnray.options.file import take_options

pinnray = App(
    name="pinnray",
    version=program_version,
    help="Can a physics-informed neural network stand in for finite elements on a real Fin Ray finger?",
    help_epilogue=EXIT_CODES,
    result_action="return_value",
    suppress_keyboard_interrupt=False,
)
COMMANDS = (
    *(compare, report, design, mesh, material, solve, sensitivity, export),
    *(sweep, predict, explore, app, optimise),
    *(gridsearch, crossval, solvers),
    *(fiducials, calibrate, pick, points, rig, track),
)
for module in COMMANDS:
    config = take_options if module is compare else None
    name = module.__name__.rpartition(".")[2]
    pinnray.command(
        quietable(module.command), name=name, help_epilogue=EXIT_CODES, version=program_version, config=config
    )
pinnray.register_install_completion_command(help="Install the completion of commands and options in a shell.")
