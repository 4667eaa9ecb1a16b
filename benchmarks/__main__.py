"""Run every benchmark, or those named on the command line, and print their tables."""

import sys

from rich.console import Console

from benchmarks import fem_against_scikit_fem, pinn_against_fem

BENCHMARKS = {"fem": fem_against_scikit_fem.main, "pinn": pinn_against_fem.main}


def main() -> int:
    """Entry of `python -m benchmarks [fem] [pinn]`."""
    chosen = sys.argv[1:] or list(BENCHMARKS)
    unknown = [name for name in chosen if name not in BENCHMARKS]
    if unknown:
        print(f"error: no benchmark {unknown[0]!r}; there are {', '.join(BENCHMARKS)}", file=sys.stderr)
        return 2
    for name in chosen:
        Console().print(BENCHMARKS[name]())
    return 0


if __name__ == "__main__":
    sys.exit(main())
