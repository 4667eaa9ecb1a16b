"""docs/verification.md, from the measured cases."""

from collections.abc import Sequence
from pathlib import Path

from benchmarks.verification.record import Case, Row

PAGE = Path(__file__).parents[2] / "docs" / "verification.md"

HEAD = """\
# Verification of the finite elements

Every other number of this project is judged against `fem`. This page is the evidence that `fem` solves the
equations that it claims to solve: problems whose answer is known from elsewhere, solved by the code that
`fem` runs, and for finite strain `fem-nonlinear`. [Theory](theory.md) has the equations. Whether the
equations are those of a printed finger is another question, which needs a camera.

`make verification` solves all of it again, in less than a minute, and rewrites this page; `make test
ARGS=tests/verification` fails if a number leaves its bounds or if the page is out of date. Body forces and
tractions enter below `Problem`, which has only a clamp and an indenter: the stiffness is assembled and
factorised as for every finger, the nodal forces are integrated in NumPy by a rule of degree 7 that nothing
else uses, and Hooke's law is written once more, from E and ν alone. P1 and P2 are linear and quadratic
triangles. Slopes are orders of convergence in the element size, beside them the error on the finest mesh;
errors are relative; "plane" is the plane state.
"""

TAIL = """\
## Would a mistake be seen?

The tests make mistakes on purpose and demand that rows above fail: λ too large by 1 % (the slope of P2 in L2
falls from 3 to 0), the shear's energy halved, plane strain taken for plane stress, one integration point a
triangle (`tests/verification/test_mistakes.py`).
"""


def page(cases: Sequence[Case]) -> str:
    """The whole page."""
    return "\n".join([HEAD, overview(cases), *(section(case) for case in cases), TAIL])


def overview(cases: Sequence[Case]) -> str:
    """One line a case."""
    lines = ["| case | answer | elements | plane states | numbers | |", "|---|---|---|---|---|---|"]
    for case in cases:
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
            f"## {case.name[0].upper()}{case.name[1:]}\n",
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
