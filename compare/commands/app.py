"""The application of the command line with every command."""

from cyclopts import App

from compare.commands.calibrate import calibrate
from compare.commands.compare import compare
from compare.commands.crossval import crossval
from compare.commands.design import design
from compare.commands.fiducials import fiducials
from compare.commands.gridsearch import gridsearch
from compare.commands.launch import EXIT_CODES
from compare.commands.mesh import mesh
from compare.commands.optimise import optimise
from compare.commands.options_file import take_options
from compare.commands.pick import pick
from compare.commands.predict import predict
from compare.commands.quiet import quietable
from compare.commands.report import report
from compare.commands.rig import rig
from compare.commands.solve import solve
from compare.commands.solvers import solvers
from compare.commands.sweep import sweep
from compare.commands.track import track
from compare.runtime.provenance import program_version

pinnray = App(
    name="pinnray",
    version=program_version,
    help="Can a physics-informed neural network stand in for finite elements on a real Fin Ray finger?",
    help_epilogue=EXIT_CODES,
    result_action="return_value",
    suppress_keyboard_interrupt=False,
)
COMMANDS = (
    *(compare, report, design, mesh, solve, sweep, predict, optimise),
    *(gridsearch, crossval, solvers),
    *(fiducials, calibrate, pick, rig, track),
)
for command in COMMANDS:
    config = take_options if command is compare else None
    pinnray.command(quietable(command), help_epilogue=EXIT_CODES, version=program_version, config=config)
pinnray.register_install_completion_command(help="Install the completion of commands and options in a shell.")
