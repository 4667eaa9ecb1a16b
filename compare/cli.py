"""The command line: `compare`, the one-shot main job, and `pinnray` with every verb."""

import sys

from cyclopts import App

from compare.exits import EXIT_CODES
from compare.launch import launched
from compare.verbs.calibrate import calibrate
from compare.verbs.compare import compare
from compare.verbs.crossval import crossval
from compare.verbs.design import design
from compare.verbs.gridsearch import gridsearch
from compare.verbs.mesh import mesh
from compare.verbs.pick import pick
from compare.verbs.rig import rig
from compare.verbs.solve import solve
from compare.verbs.solvers import solvers
from compare.verbs.track import track

pinnray = App(
    name="pinnray",
    help="Can a physics-informed neural network stand in for finite elements on a real Fin Ray finger?",
    help_epilogue=EXIT_CODES,
    result_action="return_value",
    suppress_keyboard_interrupt=False,
)
for verb in (compare, design, mesh, solve, gridsearch, crossval, solvers, calibrate, pick, rig, track):
    pinnray.command(verb, help_epilogue=EXIT_CODES)


def main(arguments: list[str] | None = None) -> int:
    """Entry of `pinnray`."""
    return launched(lambda: pinnray(arguments, exit_on_error=False, print_error=False))


def compare_main(arguments: list[str] | None = None) -> int:
    """Entry of `compare`: the same as `pinnray compare`."""
    given = sys.argv[1:] if arguments is None else arguments
    return main(["compare", *given])


if __name__ == "__main__":
    sys.exit(main())
