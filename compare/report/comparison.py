"""A comparison that draws, reports and shows itself."""

from collections.abc import Collection
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from pinnray.comparison.evaluation.comparison import Results
from pinnray.runtime.atomic import write_text
from pinnray.runtime.errors import UserError
from pinnray.runtime.notebook import fact_table
from pinnray.runtime.text_files import as_path

if TYPE_CHECKING:
    from pinnray.runtime.figure import Figure

SHOWN = {
    "converged": "converged",
    "in_sample_mae_rss_mm": "error at markers given, mm",
    "held_out_mae_rss_mm": "error at markers held out, mm",
    "to_reference_displacement_rel_l2": "displacement to reference, rel. L²",
    "to_truth_displacement_rel_l2": "displacement to truth, rel. L²",
    "energy_N_mm_per_mm": "energy, N mm/mm",
    "seconds_s": "time, s",
}
"""Columns of `table` that a notebook shows, with their headings."""


class Comparison(Results):
    """The results of several solvers for one finger, with `table`, `plot` and `report`.

    `comparison["fem"]` is the result of one solver.
    """

    def plot(
        self, picture: str = "overlay", solvers: Collection[str] = (), width: float | None = None
    ) -> "Figure":
        """A picture of the report, as a figure that a notebook shows; `figure.save(path)` keeps it.

        Args:
            picture: `overlay`, `marker_errors`, `von_mises`, `strain_principal`, `strain_xx`, `strain_yy`,
                `strain_xy`, `force_displacement`, `losses`, `design` or `mesh`.
            solvers: Names of those whose fields are drawn, for a picture of fields; all that a page has room
                for if empty.
            width: Of the figure, mm: 85 for a journal's column, 180 for its page; type has 8 to 9 points.

        Raises:
            UserError: If there is no such picture or solver, or nothing to draw in it.
        """
        from pinnray.comparison.figures import page_width
        from pinnray.comparison.figures.gallery import draw

        chosen = [solvers] if isinstance(solvers, str) else solvers
        return draw(self, picture, chosen, page_width(width)).figure

    def report(self, path: str | Path) -> Path:
        """Write the report as one HTML file that holds its pictures, and return its path."""
        from pinnray.comparison.figures import draw_all
        from pinnray.comparison.report.html_report import report_html
        from pinnray.runtime.machine import machine, package_versions

        facts: dict[str, object] = {"design_sha256": self.design.digest, "mesh_sha256": self.mesh.digest}
        facts |= {"solvers": self.settings, "versions": package_versions(), "machine": machine()}
        file = as_path(path, "the report")
        if file.is_dir():
            raise UserError(f"the report {file} is a folder; name a file, such as report.html")
        with TemporaryDirectory() as folder:
            write_text(file, report_html(self, draw_all(Path(folder), self), facts))
        return file

    def _repr_html_(self) -> str:
        """Design, load, markers, remarks and the main columns of `table`, in a notebook."""
        given = self.observations
        facts = {
            "load": f"{self.load.kind}, (u, v) = {self.load.displacement} mm",
            "markers": f"{given.visible.sum()} of {len(given.visible)}, {given.label}: {given.source}",
            "reference": self.reference.solver,
        }
        facts |= {f"{each.solver} is not converged": each.message for each in self.unconverged}
        facts |= {f"remark {number}": remark for number, remark in enumerate(self.remarks, start=1)}
        shown = self.table()[list(SHOWN)].rename(columns=SHOWN).dropna(axis="columns", how="all")
        table: str = shown.to_html(float_format="{:.4g}".format, na_rep="–")
        return fact_table(f"Comparison of finger “{self.design.name}”", facts) + table
