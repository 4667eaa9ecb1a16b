"""Run the benchmarks that the command line names, or the short ones, and print their tables."""

import argparse
import importlib
import sys

from rich.console import Console, RenderableType

from pinnray.runtime.errors import UserError

BENCHMARKS = {
    "results": "results.default_run:main",
    "default": "results.default_time:main",
    "entries": "entries.run:small",
    "full-entries": "entries.run:full",
    "page": "entries.run:page",
    "references": "entries.references:main",
    "scenes": "tracker.scenes:main",
    "stress": "tracker.stress:main",
    "verification": "verification.document:main",
    "validation": "validation.document:main",
    "reliability": "reliability.faults:main",
}
"""Names, and functions that return a table; the modules' docstrings have descriptions and times."""

ROWED = ("entries", "full-entries", "references", "stress", "reliability")


def show(table: RenderableType, console: Console | None = None) -> None:
    """Print a table as wide as it is: a terminal of 80 columns would cut the headings of its columns."""
    console = console or Console()
    wide = console.measure(table, options=console.options.update(max_width=400)).maximum
    console.width = max(console.width, wide)
    console.print(table)


def main() -> int:
    """Entry of `python -m benchmarks [NAME ...] [--rows WORDS]`."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", default=["page"], metavar="NAME", help=", ".join(BENCHMARKS))
    parser.add_argument("--rows", default="", help=f"words in the names of the rows of {' and '.join(ROWED)}")
    arguments = parser.parse_args()
    for name in arguments.names:
        if name not in BENCHMARKS:
            names = ", ".join(BENCHMARKS)
            parser.error(f"no benchmark {name!r}; there are {names}; docs/evidence/tried.md has former ones")
    for name in arguments.names:
        options = {"rows": arguments.rows} if arguments.rows and name in ROWED else {}
        module, _, function = BENCHMARKS[name].partition(":")
        try:
            show(getattr(importlib.import_module(f"benchmarks.{module}"), function)(**options))
        except ModuleNotFoundError as error:
            print(f"error: {name} needs {error.name}; pip install 'pinn-ray[dev]'", file=sys.stderr)
            return 2
        except UserError as error:
            print(f"error: {error}", file=sys.stderr)
            return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
