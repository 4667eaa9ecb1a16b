"""Print the answers of finished runs."""

from pathlib import Path

from rich.console import Console

from pinnray.runtime.exits import shown
from pinnray.runtime.tables import terminal_table

MOST_COLUMNS = 6
"""Of a table that is printed: a wider one is in the report."""


def command(run: Path, *more: Path) -> int:
    """Print the answers of a finished run, and where its report is.

    Example: pinnray report out/default

    Args:
        run: Output folder of `compare`.
        more: Further runs, one after another.
    """
    from pinnray.comparison.evaluation.scores import Scores
    from pinnray.comparison.report.summary import answers

    for folder in (run, *more):
        for answer in answers(Scores.read(folder)):
            said = [answer.question, f"  {answer.verdict}", *(f"  - {each}" for each in answer.sentences), ""]
            print(shown("\n".join(said)))
            if (table := answer.table) and len(table.headings) <= MOST_COLUMNS:
                left = [*table.headings[:1], *table.left]
                Console().print(terminal_table(table.title, table.headings, table.rows, left=left))
        print(f"report: {folder / 'report.html'}")
    return 0
