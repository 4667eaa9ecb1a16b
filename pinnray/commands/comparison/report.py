"""Read finished runs: the answers of one, or several side by side."""

from pathlib import Path

from pinnray.commands.quiet import quietable
from pinnray.options.shared import OptionalOutputPath
from pinnray.runtime.errors import UserError
from pinnray.runtime.exits import shown


@quietable
def command(*runs: Path, out: OptionalOutputPath = None) -> int:
    """Read one finished run, or several side by side.

    One gives its answers; several (designs, seeds, settings) make one page and one table. Examples:

    - pinnray report out/default
    - pinnray report out/default out/slender
    - pinnray report out/seed-* --out out/seeds

    Args:
        runs: Output folders of `compare`. One: its answers are printed, and where its report is. Several:
            a page runs.html and a table runs.csv with all of their numbers.
        out: Folder of the page and the table; default out/side-by-side.
    """
    from pinnray.comparison.report.runs import read_runs, write_side_by_side

    if not runs:
        raise UserError("no run was given; name output folders of compare, such as out/default")
    found = read_runs(runs)
    if len(found) > 1:
        folder = Path("out/side-by-side") if out is None else out
        if folder.exists() and not folder.is_dir():
            raise UserError(f"{folder} is a file; name an output folder")
        page, table = write_side_by_side(folder, found)
        print(f"report: {page}\ntable: {table}")
        return 0
    if out is not None:
        raise UserError("--out is for several runs; the report of one is in its own folder")
    for answer in found[0].answers:
        lines = [answer.question, f"  {answer.verdict}", *(f"  - {each}" for each in answer.sentences), ""]
        print(shown("\n".join(lines)))
    print(f"report: {found[0].folder / 'report.html'}")
    return 0
