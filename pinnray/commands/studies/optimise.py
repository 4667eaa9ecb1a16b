"""Find the fingers that no other finger beats."""

from pathlib import Path

from rich.console import Console

from pinnray.options.shared import StudyOptions, going_on_from, read_formats


def command(question: Path, *, options: StudyOptions = StudyOptions()) -> int:
    """Find the fingers that no other finger beats: the best ones by a quantity, or the front of two or three.

    An emulator proposes fingers and the solver judges each of them. Writes the fingers as a table, a design
    file for each of them, and a page with pictures. Each run is kept: the same command again goes on
    where it was stopped.

    Args:
        question: TOML file with objectives, constraints, the ranges of the parameters and the solver.
    """
    from pinnray.runtime.stages import Stages
    from pinnray.runtime.tables import terminal_table
    from pinnray.studies.optimum.page import front_table, text_table, write_front
    from pinnray.studies.optimum.question import Question
    from pinnray.studies.optimum.search import search_front

    formats, page = read_formats(options)
    read = Question.load(question)
    job = options.job(read, question, "optimum")
    with going_on_from(job.out), Stages() as stages:
        found = search_front(job, stages)
        with stages.stage("pictures"):
            paths, designs = write_front(found, job, job.out, stages.record(), formats, page)
    columns = [0, *range(2, 2 + len(read.names))]  # the table in the file is too wide for a terminal
    shown = text_table(read.heading, front_table(found).iloc[:, columns])
    Console().print(terminal_table(shown.title, shown.headings, shown.rows))
    print(*paths, designs[0], designs[-1], sep="\n")
    return 0
