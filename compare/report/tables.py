"""The numbers of a comparison as CSV files and for the terminal, among them Table I of the paper.

The paper gives all nine markers to the solver that assimilates them, and judges it by the same nine: that is
a training error. Errors at markers that a solver was not given are other columns here.
"""

from collections.abc import Sequence
from math import isnan, nan
from pathlib import Path
from typing import NamedTuple

from rich.table import Table

from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.evaluation.scores import MEANS, Means, Scores
from pinnray.comparison.report.numbers import at_markers, seconds, share, truth_errors
from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.finger.parameters import SYMBOLS
from pinnray.runtime.tables import NONE, Cell, terminal_table, write_csv

RIGID = "rigid motion off"
"""What is added to the name of a solver whose markers are moved rigidly to the pressed picture."""


class Row(NamedTuple):
    """One solver's errors in Table I."""

    solver: str
    converged: bool | None  # None for the paper's
    source: str  # of the displacements of the markers
    given: Means | None  # at markers that it was given; None if it was given none
    held_out: Means | None  # at markers that it was not given: all, or each in its turn; None if unknown

    @property
    def label(self) -> str:
        """The solver's name, marked where it did not converge, or as the paper's."""
        if self.converged is None:
            return f"{PAPER}: {self.solver}"
        return self.solver if self.converged else f"{self.solver} (not converged)"

    def cells(self, kind: str) -> list[str]:
        """The means of `given` or `held_out`, mm, to 0.001; the paper's without a last zero, as there."""
        texts = [at_markers(getattr(getattr(self, kind), name, nan)) for name in MEANS]
        return [text.removesuffix("0") if self.converged is None else text for text in texts]


PAPER = "paper"


def _printed(u: float, v: float, rss: float) -> Means:
    return Means(mae_u=u, mae_v=v, mae_sum=nan, mae_rss=rss)


PRINTED = (
    Row("FEM", None, PAPER, None, _printed(1.41, 0.39, 1.463)),
    Row("PINN-Ray std", None, PAPER, None, _printed(1.37, 0.48, 1.452)),
    Row("PINN-Ray asm", None, PAPER, _printed(0.03, 0.00, 0.03), None),
)
"""Table I as it is printed: nine markers of the paper's own experiment, whose data is not published.

Source: X. Wang et al., PINN-Ray, arXiv:2407.08222, Table I.
"""


def printed_rows(finger: Finger) -> tuple[Row, ...]:
    """The rows that the paper prints, for a finger with its nine parameters; none for another."""
    own, paper = finger.definition(), Design()
    same = all(own.get(name) == getattr(paper, name) for name in SYMBOLS.values())
    return PRINTED if same else ()


def table_one(scores: Scores) -> list[Row]:
    """A row of Table I for each solver of this run, and one more for its markers without a rigid motion."""
    rows, source = [], scores.measurements.source
    for name, own in scores.solvers.items():
        rows.append(Row(name, own.converged, source, own.given, own.held_out))
        if own.rigid_motion_off:
            rows.append(Row(f"{name}, {RIGID}", own.converged, source, None, own.rigid_motion_off))
    return rows


def _write(path: Path, rows: Sequence[dict[str, Cell]]) -> None:
    """Write rows; a number that does not exist is an empty cell, and yes and no are 1 and 0."""

    def shown(cell: Cell) -> Cell:
        if isinstance(cell, bool):
            return int(cell)
        return "" if isinstance(cell, float) and isnan(cell) else cell

    write_csv(path, [{name: shown(cell) for name, cell in row.items()} for row in rows])


def write_table_one(path: Path, comparison: Results) -> None:
    """Write a row a solver, then `printed_rows`; cells without a number are empty."""
    rows: list[dict[str, Cell]] = []
    for row in (*table_one(comparison.scores), *printed_rows(comparison.design)):
        converged = "" if row.converged is None else row.converged
        rows.append({"solver": row.solver, "converged": converged, "observations": row.source})
        for kind, means in (("in_sample", row.given), ("held_out", row.held_out)):
            rows[-1] |= {f"{kind}_{name}_mm": getattr(means, name, nan) for name in MEANS}
    _write(path, rows)


def write_markers(path: Path, comparison: Results) -> None:
    """Write a row a marker: its place and observed motion, every solver's displacement and its errors.

    A displacement is what the measurement's pictures show of it, if the solver found their frames.

    The cells of observations and errors are empty at markers that were not seen; those of held-out errors
    are also empty where a solver that was given the marker does not tell its prediction without it.
    """
    observations = comparison.observations
    rows: list[dict[str, Cell]] = []
    for marker, (x, y) in enumerate(observations.points.tolist()):
        seen = bool(observations.visible[marker])
        u, v = observations.displacements[marker].tolist() if seen else (nan, nan)
        row: dict[str, Cell] = {"marker": marker + 1, "x_mm": x, "y_mm": y}
        row |= {"observations": observations.label, "visible": seen, "observed_u_mm": u, "observed_v_mm": v}
        for each in comparison.evaluations:
            own, name = comparison.scores[each.solver], each.solver
            row |= {f"{name}_converged": each.converged, f"{name}_in_sample": each.in_sample}
            displacement = each.shown_displacement[marker].tolist()
            row |= dict(zip((f"{name}_u_mm", f"{name}_v_mm"), displacement, strict=True))
            for kind, errors in (("ae", own.markers), ("held_out_ae", own.held_out)):
                for axis in "uv":
                    row[f"{name}_{kind}_{axis}_mm"] = getattr(errors, f"ae_{axis}")[marker] if errors else nan
        rows.append(row)
    _write(path, rows)


def write_summary(path: Path, comparison: Results) -> None:
    """Write a row a solver: errors at the markers, distances over the body, energy, reaction, status."""
    _write(path, comparison.scores.rows())


def marker_table(comparison: Results) -> Table:
    """Mean absolute errors at the markers; below, for the paper's finger, the paper's own numbers."""
    observations, printed = comparison.observations, printed_rows(comparison.design)
    rows = table_one(comparison.scores)
    seen, count = int(observations.visible.sum()), len(observations.visible)
    markers = f"{count} marker{'s' * (count > 1)}" if seen == count else f"{seen} of {count} markers"
    caption = (
        "given: at markers that the solver was given, a training error.\n"
        "held out: at markers that it was not given; a solver that takes markers\n"
        "predicts each from the others.\n"
        "sum: mean of |Δu| + |Δv| (the paper's text); rss: √(u² + v²) (its Table I)."
        + ("\npaper: as it prints them, of its own experiment and not of this run." if printed else "")
    )
    if len(rows) > len(comparison.evaluations):
        caption += f"\n{RIGID}: turned and shifted to be nearest to the pressed picture."
    table = _table(
        f"Mean absolute error at {markers}, mm ({observations.label} displacements)",
        ["given\nu", "\nv", "\nsum", "\nrss", "held out\nu", "\nv", "\nsum", "\nrss"],
        [(row.label, bool(row.converged), [*row.cells("given"), *row.cells("held_out")]) for row in rows],
        caption,
    )
    table.add_section()
    for row in printed:
        label = row.label.replace("PINN-Ray ", "")
        table.add_row(label, *row.cells("given"), *row.cells("held_out"), style="dim")
    return table


def body_table(comparison: Results) -> Table:
    """Distances over the body, error of the force, and time."""
    scores, truth = comparison.scores, comparison.truth
    reference = scores.label(scores.reference)
    known = scores[scores.reference].to_reference.reference_uncertainty
    lines = [f"from ref.: relative L² difference of the displacement from {reference}."]
    if known and len(scores.solvers) > 1:
        own_error = share(known.rel_l2_displacement)
        lines.append(
            f"{reference} itself is off by {own_error}, estimated; a smaller difference says nothing."
        )
    lines.append("above fem: energy of the displacement on fem's elements above the least there.")
    if truth is not None:
        lines.append("truth: relative L² difference from the simulated finger of finite strain;")
        lines.append("force: signed error of the force along the stroke.")
    rows = []
    for name, own in scores.solvers.items():
        away = own.to_reference.rel_l2_displacement
        above = share(own.certificate.excess_beyond_rounding) if own.certificate else NONE
        cells = [NONE if name == scores.reference else share(away), above, *truth_errors(own), seconds(own)]
        rows.append((scores.label(name), own.converged, cells))
    headings = ["truth\ndispl.", "\nv. Mises", "\nforce"] if truth else []
    headings = ["from ref.", "above fem", *headings, "time\ns"]
    return _table("Over the whole body", headings, rows, "\n".join(lines))


def _table(title: str, headings: list[str], rows: list[tuple[str, bool, list[str]]], caption: str) -> Table:
    """A table whose rows are yellow where the solver did not converge."""
    table = terminal_table(title, ["solver", *headings], [], caption=caption, left=["solver"])
    table.collapse_padding, table.pad_edge = True, True
    for label, converged, cells in rows:
        style = None if converged else "yellow"
        table.add_row(label.replace(" (", "\n(").replace(", ", ",\n"), *cells, style=style)
    return table
