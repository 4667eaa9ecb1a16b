"""docs/verification.md, from the measured cases."""

from collections.abc import Sequence
from pathlib import Path

from benchmarks.verification.record import Case, Row

PAGE = Path(__file__).parents[2] / "docs" / "verification.md"

HEAD = """\
# Verification of the finite elements

All other results of this project are compared with `fem`. This page verifies `fem`, and for finite strain
`fem-nonlinear` and in space `fem-3d`, on problems with known solutions, solved by their own code.
[Theory](theory/index.md) has the equations. Whether they describe a real body is a question of
[validation](validation.md).

`make verification` repeats all of it in less than a minute and rewrites this page; `make test-all
ARGS=tests/verification` fails if a number leaves its bounds or if the page is out of date. `Problem` has only
a clamp and an indenter, so body forces and tractions are applied below it: the stiffness matrix is assembled
and factorised as for every finger, the nodal forces are integrated in NumPy by a separate rule of degree 7,
and Hooke's law is implemented independently, from E and ν alone. P1 and P2 are linear and quadratic
triangles. Slopes are orders of convergence in the element size, with the error on the finest mesh; errors are
relative; "plane" is the plane state, or "space".
"""

TAIL = """\
## Would a mistake be seen?

The tests make mistakes on purpose and require that rows above fail: λ too large by 1 % (the slope of P2 in L2
falls from 3 to 0), half the shear energy, plane strain instead of plane stress, one integration point a
triangle (`tests/verification/test_mistakes.py`).
"""


def page(cases: Sequence[Case], before: str) -> str:
    """The whole page; a case whose program is not installed stays as it was on the page before."""
    sections = (section(case) if case.available else kept_section(case, before) for case in cases)
    return "\n".join([HEAD, overview(cases, before), *sections, TAIL])


def kept_section(case: Case, before: str) -> str:
    """The section of a case on an earlier page."""
    return title(case) + before.partition(title(case))[2].partition("\n## ")[0]


def title(case: Case) -> str:
    """The line above a section."""
    return f"## {case.name[0].upper()}{case.name[1:]}\n"


def overview(cases: Sequence[Case], before: str) -> str:
    """One line a case."""
    lines = ["| case | answer | elements | plane states | numbers | |", "|---|---|---|---|---|---|"]
    for case in cases:
        if not case.available:
            lines += [line for line in before.splitlines() if line.startswith(f"| [{case.name}](")]
            continue
        rows = case.rows()
        elements = ", ".join(f"P{degree}" for degree in sorted({row.degree for row in rows}))
        planes = ", ".join(sorted({row.plane for row in rows}))
        passed = sum(row.passed for row in rows)
        anchor = "".join(letter for letter in case.name.lower() if letter.isalnum() or letter in " -")
        link = f"[{case.name}](#{anchor.replace(' ', '-')})"
        mark = "✓" if passed == len(rows) else f"✗ {passed}"
        lines.append(f"| {link} | {case.answer} | {elements} | {planes} | {len(rows)} | {mark} |")
    return "\n".join(lines) + "\n"


def section(case: Case) -> str:
    """A case with its explanation, source and numbers."""
    header = ["| element | plane | quantity | measured | expected | |", "|---|---|---|---|---|---|"]
    return "\n".join(
        [
            title(case),
            case.text.strip() + "\n",
            f"Source: {case.source}.\n",
            *header,
            *(line(row) for row in case.rows()),
            "",
        ]
    )


def line(row: Row) -> str:
    """A row of the table."""
    mark = "✓" if row.passed else "✗"
    return f"| P{row.degree} | {row.plane} | {row.quantity} | {row.shown} | {row.expected.words} | {mark} |"
