"""Printed fingers, and a soft beam: COMSOL's figures, Young's modulus from one film, the others predicted.

Writes docs/validation.md, whose words are in `page.md`, and its pictures; seven minutes on a free core.
"""

import logging
from pathlib import Path
from string import Template
from textwrap import fill

import numpy as np
from rich.table import Table

from benchmarks.tables import DOCS, markdown
from benchmarks.validation import comsol
from benchmarks.validation.fingers import of_fingers
from benchmarks.validation.half_beam import CELLS, HalfBeam
from benchmarks.validation.markers import (
    FEET,
    LOADS,
    NAMES,
    NOMINAL,
    Frame,
    Run,
    frames,
    length,
    measured,
    moved_feet,
    read_runs,
)
from benchmarks.validation.picture import side_view
from benchmarks.validation.study import Outcome, all_cases, predict, young_modulus
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.atomic import write_text
from pinnray.runtime.tables import terminal_table

PAGE, PICTURE = DOCS / "validation.md", DOCS / "pictures" / "soft-beam.png"

FINENESS, FINEST = 2, 3
"""Of the mesh that predicts, and of the one that judges the others."""

HEADER = (
    *("case", "load, N", "moved, mm", "error, mm", "error, %", "repeats, mm", "authors, mm"),
    "E alone, kPa",
)


def main() -> Table:
    """Compute everything, write the page and its picture."""
    logging.disable(logging.INFO)  # the compiler's log
    runs = read_runs()
    fitted = frames(runs)
    beam = HalfBeam(FINENESS)
    outcome = predict(beam, measured(runs, fitted))
    rows = prediction_rows(beam, outcome)
    words = Template(Path(__file__).with_name("page.md").read_text(encoding="utf-8"))
    values = of_comsol() | of_frames(runs, fitted) | of_predictions(outcome) | of_choices(runs, fitted)
    loads = {case: f"{load:.2f}" for case, load in LOADS.items()}
    printed, pictures = of_fingers()
    for name, each in pictures.items():
        each.save(PICTURE.with_name(f"printed-{name}.png"))
    write_text(
        PAGE, reflowed(words.substitute(loads | printed, predictions=markdown(HEADER, rows), **values))
    )
    side_view(outcome).save(PICTURE)
    title = f"Soft beam: E = {1000 * outcome.modulus:.0f} kPa from gravity alone"
    return terminal_table(title, HEADER, rows, left=["case"])


def reflowed(text: str) -> str:
    """Markdown with its paragraphs broken anew, because numbers are shorter than their names."""
    paragraphs = (
        each if each[0] in "#|!-" else fill(each, 110, break_long_words=False, break_on_hyphens=False)
        for each in text.strip().replace("\n\n\n", "\n\n").split("\n\n")
    )
    return "\n\n".join(paragraphs) + "\n"


def triple(vector: FloatArray, digits: int = 2) -> str:
    """Components of a vector, without negative zeros."""
    return ", ".join(f"{value:.{digits}f}" for value in vector.round(digits) + 0.0)


def boxes(fineness: int) -> str:
    """Number of cells of a mesh in each direction."""
    return " x ".join(str(fineness * number) for number in CELLS)


def of_comsol() -> dict[str, str]:
    """Comparison with COMSOL, and refinement."""
    laws = {"neo-Hookean": "neo-hookean", "St Venant-Kirchhoff": "st-venant-kirchhoff"}
    compared = {
        name: all_cases(HalfBeam(law=law, cell="tetrahedron", strip=0.0), comsol.MODULUS)
        for name, law in laws.items()
    }
    finest = compared["converged"] = all_cases(HalfBeam(FINEST), comsol.MODULUS)
    rows, away = [], dict.fromkeys(compared, 0.0)
    for case, places in comsol.PLACES.items():
        differences = {name: moved_feet(found[case]) - places for name, found in compared.items()}
        away = {name: max(away[name], float(np.abs(differences[name]).max())) for name in compared}
        for index, foot in enumerate(FEET):
            columns = (triple(each[index]) for each in (places, *differences.values()))
            rows.append((case, triple(foot, 0), *columns))
    rows.append(("largest", "", "", *(f"{value:.2f}" for value in away.values())))
    refined, edge = [], []
    for where, strip in (("6 mm of the face", 6.0), ("the edge", 0.0)):
        for fineness in range(1, FINEST):
            found = all_cases(HalfBeam(fineness, strip=strip), comsol.MODULUS)
            edge.append(moved_feet(found["load101"])[0, 2])
            changes = (np.abs(moved_feet(found[case]) - moved_feet(finest[case])).max() for case in LOADS)
            refined.append((where, boxes(fineness), *(f"{change:.3f}" for change in changes)))
    halved = all_cases(HalfBeam(2, cell="tetrahedron", strip=0.0), comsol.MODULUS)
    off = max(float(np.abs(moved_feet(halved[case]) - comsol.PLACES[case]).max()) for case in LOADS)
    lengths = {
        **{"away_hooke": away["neo-Hookean"], "away_kirchhoff": away["St Venant-Kirchhoff"]},
        **{"away_converged": away["converged"], "off": off, "sinks": edge[2] - edge[3]},
        "across": max(abs(places[0, 1] - 15) for places in comsol.PLACES.values()),
    }
    return {
        "comsol_pascal": f"{1e6 * comsol.MODULUS:,.0f}",
        "comsol_kpa": f"{1000 * comsol.MODULUS:.0f}",
        "coarse": boxes(1),
        "finest": boxes(FINEST),
        "comsol_places": markdown(("case", "point", "COMSOL", *compared), rows),
        "refined": markdown(("load on", "hexahedra", *LOADS), refined),
        **{name: f"{value:.2f}" for name, value in lengths.items()},
    }


def of_frames(runs: list[Run], fitted: list[Frame]) -> dict[str, str]:
    """The frame of the cameras in that of the beam."""
    pairs = list(zip(runs, fitted, strict=True))
    rows = []
    for index, name in enumerate(NAMES):
        away = [length(frame.of(run.held)[[index]] - NOMINAL[[index]]) for run, frame in pairs]
        rows.append((name, *(f"{value:.2f}" for value in np.reshape(away, (-1, 2)).mean(axis=1))))
    ahead = [frame.of(run.rest)[4, 0] - frame.of(run.rest)[5, 0] for run, frame in pairs]
    first, middle, last = np.reshape(ahead, (-1, 2)).mean(axis=1)
    return {
        "from_nominal": markdown(("marker", *LOADS), rows),
        "gives52": f"{middle - first:.1f}",
        "gives101": f"{last - first:.1f}",
    }


def prediction_rows(beam: HalfBeam, outcome: Outcome) -> list[tuple[str, ...]]:
    """One row a case, below `HEADER`."""
    rows = []
    for case, load in LOADS.items():
        alone = young_modulus(beam, case, outcome.measured[case].mean(axis=0))
        error, moved = outcome.error(case), outcome.moved(case)
        others = (f"{value:.2f}" for value in (outcome.repeats(case), outcome.authors_error(case)))
        name = f"{case}, {'fitted' if case == 'gravity' else 'predicted'}"
        percent = f"{100 * error / moved:.0f}"
        rows.append(
            (name, f"{load:.3f}", f"{moved:.1f}", f"{error:.2f}", percent, *others, f"{1000 * alone:.0f}")
        )
    return rows


def of_predictions(outcome: Outcome) -> dict[str, str]:
    """The modulus and its errors."""
    markers = [
        (name, *(triple(outcome.errors(case)[index]) for case in LOADS))
        for index, name in enumerate(NAMES[:3])
    ]
    ratios = {case: outcome.error(case) / outcome.repeats(case) for case in ("load52", "load101")}
    return {
        "modulus": f"{1000 * outcome.modulus:.0f}",
        "errors": markdown(("marker", *LOADS), markers),
        "own_error": f"{outcome.error('gravity'):.1f}",
        **{case.replace("load", "ratio"): f"{ratio:.1f}" for case, ratio in ratios.items()},
    }


def of_choices(runs: list[Run], fitted: list[Frame]) -> dict[str, str]:
    """The predictions with other choices, on the coarsest mesh."""
    beam, places = HalfBeam(), measured(runs, fitted)
    down = fitted[0].rotation @ [-1, 0, 0]
    tilt = float(np.arctan2(down[0], -down[2]))
    without = tuple(name for name in NAMES if name != "Base-2")
    refitted = {
        "a frame for each film, as the authors": frames(runs, each_run=True),
        "frame without Base-2": frames(runs, markers=without),
        "frame from the clamp's markers alone": frames(runs, markers=NAMES[3:]),
    }
    choices = {
        "as above": predict(beam, places),
        **{name: predict(beam, measured(runs, frame)) for name, frame in refitted.items()},
        "markers where the held beam has them": predict(beam, measured(runs, fitted, from_held=True)),
        f"gravity along the cameras' -x, {np.degrees(tilt):.0f}° from -z": predict(beam, places, tilt=tilt),
        "load on the edge itself": predict(HalfBeam(strip=0.0), places),
        "St Venant-Kirchhoff": predict(HalfBeam(law="st-venant-kirchhoff"), places),
    }
    header = ("choice", "E, kPa", *(f"error, {case}" for case in LOADS))
    rows = [
        (name, f"{1000 * found.modulus:.0f}", *(f"{found.error(case):.2f}" for case in LOADS))
        for name, found in choices.items()
    ]
    usual = choices["as above"].modulus
    change = max(abs(found.modulus / usual - 1) for name, found in choices.items() if "clamp's" not in name)
    return {"choices": markdown(header, rows), "change": f"{100 * change:.1f}"}
