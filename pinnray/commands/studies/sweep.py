"""Solve many fingers."""

from pathlib import Path

from rich.console import Console

from compare.runtime.exits import NOT_CONVERGED, say
from pinnray.options.shared import OptionalOutputPath, read_formats, read_processes


def sweep(
    study: Path,
    *,
    processes: int | None = None,
    scheduler: str | None = None,
    pictures: str = "",
    out: OptionalOutputPath = None,
) -> int:
    """Solve many fingers: the samples of a study over parameters of design, material and load.

    Writes a table of force, wrap angle, compliance, stress and more, and a page with pictures. Each result is
    kept at once: the same command again goes on where it was stopped.

    Args:
        study: TOML file with the ranges of the parameters, the sampling and the solver.
        processes: Worker processes on this machine; default: one per core.
        scheduler: Address of a Dask scheduler whose workers are used, such as tcp://host:8786; default: none.
        pictures: Formats of the pictures besides PNG (default: none), separated by commas: svg, pdf.
        out: Output folder; default out/sweep-NAME.
    """
    from compare.runtime.stages import Stages
    from compare.runtime.tables import terminal_table
    from studies.sweep.job import StudyJob
    from studies.sweep.page import write_page
    from studies.sweep.study import load_study
    from studies.sweep.sweep import run_sweep
    from studies.sweep.tables import failure_grid, quantity_grid, write_tables

    formats = read_formats(pictures)
    read = load_study(study)
    folder = out or Path("out") / f"sweep-{read.name}"
    job = StudyJob(read, study.parent, folder, read_processes(processes), scheduler)
    try:
        with Stages() as stages:
            done = run_sweep(job, stages)
            written = write_tables(done, folder)
            with stages.stage("pictures"):
                written += write_page(done, job, folder, stages.record(), formats)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"the same command goes on from what {folder} keeps") from None
    quantities, failures = quantity_grid(done), failure_grid(done)
    for grid in (quantities, failures):
        if grid.rows:
            shown = [row[:5] if grid is quantities else row[:3] for row in grid.rows]
            headings = grid.headings[: len(shown[0])]
            Console().print(terminal_table(grid.title, headings, shown, left=grid.left))
    for path in written:
        print(path)
    for remark in done.remarks:
        say(f"warning: {remark}")
    if bad := sum(each.state in ("failed", "not converged") for each in done.measurements):
        say(
            f"error: {bad} of {len(done.samples)} samples failed or did not converge; failed ones are tried "
            "again by the same command"
        )
        return NOT_CONVERGED
    return 0
