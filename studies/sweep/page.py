"""The page of a sweep: summary, tables and pictures in one HTML file."""

from collections.abc import Collection
from pathlib import Path
from typing import Any

from pinnray.runtime import html
from pinnray.runtime.figure import Figure
from pinnray.studies.sweep.job import StudyJob
from pinnray.studies.sweep.pictures import SHOWN, draw_fingers, draw_maps, draw_pairs, draw_sensitivity
from pinnray.studies.sweep.sensitivity import TRUSTED, Sensitivity, sensitivities
from pinnray.studies.sweep.study import Study
from pinnray.studies.sweep.sweep import Sweep
from pinnray.studies.sweep.tables import failure_grid, known_quantities, quantity_grid

PAGE = "sweep.html"

FILES = (
    "samples.parquet and samples.csv (a row for each sample, units in the headings), sweep.json (the study, "
    "versions and hashes), journal.sqlite (from which the same command goes on)"
)

SAMPLED = {"grid": "on a grid", "latin": "of a Latin hypercube", "sobol": "of a Sobol sequence"}


def write_page(
    sweep: Sweep, job: StudyJob[Study], folder: Path, record: dict[str, Any], formats: Collection[str] = ()
) -> list[Path]:
    """Write the pictures and the page, and return the paths.

    Args:
        sweep: The sweep.
        job: The job that ran it.
        folder: Where to write.
        record: Start, durations and machine, from `Stages.record`.
        formats: Of the pictures besides PNG.
    """
    found = sensitivities(sweep, SHOWN)
    drawn: dict[str, tuple[Figure, str]] = {}
    if sweep.study.sampling == "grid" and len(sweep.study.varied) == 2:
        trained = "rel_l2_displacement" in known_quantities(sweep)
        names = ("rel_l2_displacement", "boundary_violation") if trained else SHOWN[:2]
        drawn["map"] = (draw_maps(sweep, names), "Quantities over both parameters; framed: the least value.")
    if len(sweep.good) > 1 and not sweep.study.settings_alone:
        drawn["pairs"] = (draw_pairs(sweep), "Quantities over the varied parameters, a dot for each finger.")
        drawn["fingers"] = (
            draw_fingers(sweep, job),
            "The fingers with the least, the median and the largest value of a quantity, to one scale.",
        )
        if found:
            drawn["sensitivity"] = (draw_sensitivity(found), sensitivity_caption(found))
    pictures = {each.save(folder / f"{name}.png", formats): text for name, (each, text) in drawn.items()}
    failures = failure_grid(sweep)
    page = html.write_html(
        folder / PAGE,
        "designs.html.j2",
        title=f"Sweep {sweep.study.name}",
        sentences=sweep_sentences(sweep),
        tables=[quantity_grid(sweep), *([failures] if failures.rows else [])],
        pictures=pictures,
        note=f"Files beside this page: {FILES}. Started {record['started']}.",
    )
    return [page, *pictures]


def sweep_sentences(sweep: Sweep) -> list[str]:
    """The sweep in sentences."""
    study = sweep.study
    found, good = len(sweep.measurements), len(sweep.good)
    varied = ", ".join(f"{name} ({_range(values)})" for name, values in study.varied.items())
    fixed = ", ".join(f"{name} = {value}" for name, value in study.fixed.items())
    sentences = [
        f"{found} of {len(sweep.samples)} samples {SAMPLED[study.sampling]} were run; {good} have a "
        f"converged result by {study.solver} with elements of {study.mesh_size:g} mm.",
        f"Varied: {varied}. The rest is that of the design {study.design}"
        + (f", with {fixed}." if fixed else "."),
    ]
    if found > good:
        sentences.append(
            f"{found - good} have none, for the reasons in the table below. Statistics, pictures and "
            "sensitivities are of the converged ones."
        )
    return [*sentences, *(f"{remark}." for remark in sweep.remarks)]


def sensitivity_caption(found: dict[str, Sensitivity]) -> str:
    """What the picture of the sensitivities shows, and how far to trust it."""
    caption = (
        "Sobol' indices by polynomial chaos: the share of a quantity's variance that each parameter causes "
        "alone and with others, if all vary independently over their ranges. The polynomials explain "
    )
    shares = [f"{100 * each.explained:.1f} % of {name}" for name, each in found.items()]
    caption += f"{', '.join(shares)} at samples that were left out of the fit."
    if any(each.explained < TRUSTED for each in found.values()):
        caption += f" Below {100 * TRUSTED:.0f} % (marked *) do not trust the indices: run more samples."
    return caption


def _range(values: Any) -> str:
    if values.values is not None:
        return " or ".join(map(str, values.values))
    return f"{values.low:g} to {values.high:g}"
