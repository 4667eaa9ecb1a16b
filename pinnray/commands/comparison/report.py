"""Print the answers of a finished run."""

from pathlib import Path

from pinnray.commands.quiet import quietable
from pinnray.runtime.exits import shown


@quietable
def command(run: Path) -> int:
    """Print the answers of a finished run, and where its report is.

    Example: pinnray report out/default

    Args:
        run: Output folder of `compare`.
    """
    from pinnray.comparison.evaluation.metrics import Scores
    from pinnray.comparison.report.summary import answers

    for answer in answers(Scores.read(run)):
        lines = [answer.question, f"  {answer.verdict}", *(f"  - {each}" for each in answer.sentences), ""]
        print(shown("\n".join(lines)))
    print(f"report: {run / 'report.html'}")
    return 0
