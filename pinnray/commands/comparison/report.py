"""Print the answers of finished runs."""

from pathlib import Path

from pinnray.runtime.exits import shown


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
        print(f"report: {folder / 'report.html'}")
    return 0
