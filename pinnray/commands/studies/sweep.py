"""Solve many fingers."""

from pathlib import Path

from rich.console import Console

from pinnray.options.shared import StudyOptions, going_on_from, read_formats
from pinnray.runtime.exits import NOT_CONVERGED, say


def command(study: Path, *, options: StudyOptions = StudyOptions()) -> int:
    """Solve many fingers: the samples of a study over parameters of design, material and load.

    Writes a table of force, wrap angle, compliance, stress and more, and a page with pictures. Each result is
    kept at once: the same command again goes on where it was stopped.

    Args:
        study: TOML file with the ranges of the parameters, the sampling and the solver.
    """
    from pinnray.runtime.stages import Stages
    from pinnray.runtime.tables import terminal_table
    from pinnray.studies.sweep.page import write_sweep
    from pinnray.studies.sweep.study import Study
    from pinnray.studies.sweep.sweep import run_sweep
    from pinnray.studies.sweep.tables import failure_grid, quantity_grid

    formats, page = read_formats(options)
    read = Study.load(study)
    job = options.job(read, study, "sweep")
    with going_on_from(job.out), Stages() as stages:
        done = run_sweep(job, stages)
        with stages.stage("pictures"):
            written = write_sweep(done, job.out, stages.record(), formats, page)
    quantities, failures = quantity_grid(done), failure_grid(done)
    for grid in (quantities, failures):
        if grid.rows:
            shown = [row[:5] if grid is quantities else row[:3] for row in grid.rows]
            headings = grid.headings[: len(shown[0])]
            Console().print(terminal_table(grid.title, headings, shown, left=grid.left))
    print(*written, sep="\n")
    for remark in done.remarks:
        say(f"warning: {remark}")
    if bad := sum(each.state in ("failed", "not converged") for each in done.measurements):
        say(
            f"error: {bad} of {len(done.samples)} samples failed or did not converge; failed ones are tried "
            "again by the same command"
        )
        return NOT_CONVERGED
    return 0
