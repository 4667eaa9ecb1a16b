"""Measure every case and write docs/verification.md; ends with 1 if a number is out of its bounds."""

import sys

from rich.console import Console

from benchmarks.verification.cases import CASES
from benchmarks.verification.document import PAGE, page


def main() -> int:
    """Entry of `python -m benchmarks.verification`."""
    console = Console(highlight=False)
    missed = 0
    for case in CASES:
        if not case.available:
            console.print(f"{case.name}: left as it is on the page, because {case.needs} is not installed")
            continue
        failed = [row for row in case.rows() if not row.passed]
        missed += len(failed)
        console.print(f"{case.name}: {len(case.rows()) - len(failed)} of {len(case.rows())} as expected")
        for row in failed:
            console.print(
                f"  P{row.degree}, {row.plane}: {row.quantity}: {row.shown}, not {row.expected.words}"
            )
    PAGE.write_text(page(CASES, PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    console.print(f"wrote {PAGE}")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
