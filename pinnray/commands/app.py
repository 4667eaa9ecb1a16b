"""The application of the command line with every command."""

from cyclopts import App

from compare.runtime.provenance import program_version
from pinnray.commands.camera.calibrate import calibrate
from pinnray.commands.camera.fiducials import fiducials
from pinnray.commands.camera.pick import pick
from pinnray.commands.camera.points import points
from pinnray.commands.camera.rig import rig
from pinnray.commands.camera.track import track
from pinnray.commands.comparison.compare import compare
from pinnray.commands.comparison.crossval import crossval
from pinnray.commands.comparison.report import report
from pinnray.commands.comparison.solvers import solvers
from pinnray.commands.finger.design import design
from pinnray.commands.finger.export import export
from pinnray.commands.finger.material import material
from pinnray.commands.finger.mesh import mesh
from pinnray.commands.finger.sensitivity import sensitivity
from pinnray.commands.finger.solve import solve
from pinnray.commands.launch import EXIT_CODES
from pinnray.commands.quiet import quietable
from pinnray.commands.studies.explore import app, explore
from pinnray.commands.studies.gridsearch import gridsearch
from pinnray.commands.studies.optimise import optimise
from pinnray.commands.studies.predict import predict
from pinnray.commands.studies.sweep import sweep
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
for command in COMMANDS:
    config = take_options if command is compare else None
    pinnray.command(quietable(command), help_epilogue=EXIT_CODES, version=program_version, config=config)
pinnray.register_install_completion_command(help="Install the completion of commands and options in a shell.")
