"""docs/verification.md, from the measured cases and the words of `page.md`."""

from collections.abc import Sequence
from pathlib import Path
from string import Template

from benchmarks.verification.record import Case, Row

PAGE = Path(__file__).parents[2] / "docs" / "verification.md"


def page(cases: Sequence[Case], before: str) -> str:
    """The whole page; a case whose program is not installed stays as it was on the page before."""
    sections = (section(case) if case.available else kept_section(case, before) for case in cases)
    words = Template(Path(__file__).with_name("page.md").read_text(encoding="utf-8"))
    return words.substitute(overview=overview(cases, before), sections="\n".join(sections))


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
