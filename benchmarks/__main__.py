"""Run the benchmarks that the command line names, or the short ones, and print their tables."""

import argparse
import importlib
import sys

from rich.console import Console, RenderableType

from geometry.errors import UserError

BENCHMARKS = {
    "fem": "fem_against_scikit_fem",
    "million": "million_triangles",
    "pinn": "pinn_against_fem",
    "designs": "networks_on_designs",
    "drawings": "networks_on_drawings",
    "sizes": "network_sizes",
    "inference": "inference",
    "deepxde": "deepxde_against_ours",
    "recipes": "pinn_recipes",
    "epochs": "deepxde_epochs",
    "kernels": "kernels",
    "meshing": "meshing",
    "scenes": "tracker_scenes",
    "stress": "tracker_stress",
    "live": "live_tracking",
    "localisation": "localisation",
    "dots": "printed_dots",
    "validation": "validation.document",
    "results": "default_run",
    "default": "default_time",
    "readings": "readings",
    "plane_strain": "plane_strain",
    "paper": "paper_run",
    "contact": "network_contact",
    "trained": "trained_networks",
    "sweep": "sweeping",
    "predict": "emulators",
    "optimise": "fronts",
    "reliability": "reliability.document",
}
"""Names and modules; the modules' docstrings have descriptions and times."""

WIDEST = 400
"""Columns of the widest table."""
SHORT = ("fem", "pinn")
TIMED = ("deepxde", "recipes", "paper", "trained")
ROWED = ("stress", "reliability")


def show(table: RenderableType, console: Console | None = None) -> None:
    """Print a table as wide as it is: a terminal of 80 columns would cut the headings of its columns."""
    console = console or Console()
    wide = console.measure(table, options=console.options.update(max_width=WIDEST)).maximum
    console.width = max(console.width, wide)
    console.print(table)


def main() -> int:
    """Entry of `python -m benchmarks [NAME ...] [--seconds S] [--rows WORDS]`."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=f"{', '.join(BENCHMARKS)}; default: fem pinn"
    )
    parser.add_argument("--seconds", type=float, help=f"budget of each training in {' and '.join(TIMED)}")
    parser.add_argument("--rows", default="", help=f"words in the names of the rows of {' and '.join(ROWED)}")
    arguments = parser.parse_args()
    unknown = [name for name in arguments.names if name not in BENCHMARKS]
    if unknown:
        parser.error(f"no benchmark {unknown[0]!r}; there are {', '.join(BENCHMARKS)}")
    for name in arguments.names or SHORT:
        options = {"seconds": arguments.seconds} if arguments.seconds and name in TIMED else {}
        options |= {"rows": arguments.rows} if arguments.rows and name in ROWED else {}
        try:
            module = importlib.import_module(f"benchmarks.{BENCHMARKS[name]}")
            show(module.main(**options))
        except ModuleNotFoundError as error:
            print(f"error: {name} needs {error.name}; pip install 'pinn-ray[bench]'", file=sys.stderr)
            return 2
        except UserError as error:
            print(f"error: {error}", file=sys.stderr)
            return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
