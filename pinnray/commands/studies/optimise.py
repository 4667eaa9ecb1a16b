"""Find the fingers that no other finger beats."""

from pathlib import Path

from rich.console import Console

from pinnray.options.shared import OptionalOutputPath, read_formats, read_processes


def optimise(
    question: Path,
    *,
    processes: int | None = None,
    scheduler: str | None = None,
    pictures: str = "",
    out: OptionalOutputPath = None,
) -> int:
    """Find the fingers that no other finger beats: the Pareto front of two or three quantities.

    An emulator proposes fingers and the solver judges each of them. Writes the front as a table, a design
    file for each finger on it, and a page with pictures. Each run is kept: the same command again goes on
    where it was stopped.

    Args:
        question: TOML file with objectives, constraints, the ranges of the parameters and the solver.
        processes: Worker processes on this machine; default: one per core.
        scheduler: Address of a Dask scheduler whose workers are used, such as tcp://host:8786; default: none.
        pictures: Formats of the pictures besides PNG (default: none), separated by commas: svg, pdf.
        out: Output folder; default out/optimum-NAME.
    """
    from compare.runtime.stages import Stages
    from compare.runtime.tables import terminal_table
    from studies.optimum.page import front_grid, write_front
    from studies.optimum.question import load_question
    from studies.optimum.search import search_front
    from studies.sweep.job import StudyJob

    formats = read_formats(pictures)
    read = load_question(question)
    folder = out or Path("out") / f"optimum-{read.name}"
    job = StudyJob(read, question.parent, folder, read_processes(processes), scheduler)
    try:
        with Stages() as stages:
            found = search_front(job, stages)
            with stages.stage("pictures"):
                paths, designs = write_front(found, job, folder, stages.record(), formats)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"the same command goes on from what {folder} keeps") from None
    grid = front_grid(found)
    columns = [0, *range(2, 2 + len(read.objectives))]  # the table in the file is too wide for a terminal
    rows = [[row[column] for column in columns] for row in grid.rows]
    Console().print(terminal_table(grid.title, [grid.headings[column] for column in columns], rows))
    for path in [*paths, designs[0], designs[-1]]:
        print(path)
    return 0
