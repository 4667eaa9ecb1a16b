"""A solution that draws, writes and shows itself."""

from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.runtime.text_files import as_path
from pinnray.solvers import solution
from pinnray.solvers.finger_figures import FingerFigures, figures_of

if TYPE_CHECKING:
    import pandas as pd
    import pyvista

    from pinnray.comparison.evaluation.evaluation import Evaluation
    from pinnray.runtime.figure import Figure

FieldName = Literal["displacement", "von_mises", "strain_principal", "strain_xx", "strain_yy", "strain_xy"]


class Solution(solution.Solution):
    """A displacement field with its problem, as `pr.solve` gives it; with `plot`, `save` and tables.

    `Solution.of` makes one from the result of a solver's own `solve`.
    """

    @classmethod
    def of(cls, solved: solution.Solution, **changes: object) -> Self:
        """Give the solution of a solver its pictures, files and tables, and what is to be changed in it."""
        return cls(**vars(solved) | changes)

    @property
    def von_mises(self) -> FloatArray:
        """Von Mises stress, mean over each triangle of the mesh, shape (t,), MPa; at points: see `state`."""
        return self._fields.per_triangle(self._fields.von_mises)

    @cached_property
    def figures(self) -> FingerFigures:
        """What the finger does: force in N, tip, wrap, compliance, stress with its place, energy, mass, wall.

        Raises:
            UserError: If the problem is of a body without a depth.
        """
        return figures_of(self)

    def plot(self, quantity: FieldName = "displacement", *, scale: float = 1.0) -> "Figure":
        """A field on the deformed mesh, as a matplotlib figure that a notebook shows.

        Args:
            quantity: `displacement`: its magnitude, mm; `von_mises`: the stress, MPa; `strain_principal`: the
                largest principal strain in the plane, %; `strain_xx`, `strain_yy`, `strain_xy`, %.
            scale: Factor of the displacement that is drawn.

        Raises:
            UserError: If there is no such quantity.
        """
        from pinnray.comparison.figures.fields import VIEWED, triangle_values
        from pinnray.geometry.mesh.picture import plot_field

        known = {each.name: each for each in VIEWED}
        if quantity not in known:
            raise UserError(f"there is no field {quantity!r} to plot; there are {', '.join(known)}")
        if isinstance(scale, bool) or not isinstance(scale, int | float) or not np.isfinite(scale):
            raise UserError(f"scale = {scale!r} is not a finite number")
        chosen, evaluation = known[quantity], self._fields
        name = chosen.title[:1].lower() + chosen.title[1:]
        remark = "" if self.status.converged else " (not converged)"
        times = "true scale" if scale == 1 else f"displacement times {scale:g}"
        return plot_field(
            self.problem.mesh,
            scale * evaluation.node_displacement,
            triangle_values(chosen, evaluation),
            title=f"{self.solver}{remark}: {name}, {times}",
            label=f"{name}, {chosen.unit}",
            signed=chosen.signed,
        )

    def to_dataframe(self, at: Literal["triangles", "nodes", "markers"] = "triangles") -> "pd.DataFrame":
        """The fields as a table, with units in the names of the columns.

        Args:
            at: `triangles`: a row for each, its centroid with the means of all fields over it; `nodes` and
                `markers`: places and displacements, these in the columns of measurements.

        Raises:
            UserError: If there are no such places.
        """
        import pandas as pd

        evaluation, mesh = self._fields, self.problem.mesh
        if at == "nodes":
            places, moved = mesh.points, evaluation.node_displacement
        elif at == "markers":
            seen = self.problem.observations
            places, moved = (mesh.markers if seen is None else seen.points), self.at_markers()
        elif at == "triangles":
            places, moved = mesh.at_centroids().points, evaluation.per_triangle(evaluation.displacement)
        else:
            raise UserError(f"at = {at!r}: there are triangles, nodes, markers")
        columns: dict[str, Any] = dict(zip(("x_mm", "y_mm"), places.T, strict=True))
        columns |= dict(zip(("u_mm", "v_mm"), moved.T, strict=True))
        if at == "triangles":
            strain, stress = map(evaluation.per_triangle, (evaluation.strain, evaluation.stress))
            for name, (row, column) in {"xx": (0, 0), "yy": (1, 1), "xy": (0, 1)}.items():
                columns[f"strain_{name}"] = strain[:, row, column]
                columns[f"stress_{name}_MPa"] = stress[:, row, column]
            for name in ("stress_zz", "von_mises", "energy_density"):
                columns[f"{name}_MPa"] = evaluation.per_triangle(getattr(evaluation, name))
            columns["area_mm2"] = mesh.areas
        return pd.DataFrame(columns)

    def to_pyvista(self) -> "pyvista.UnstructuredGrid":
        """The fields as a grid of PyVista: those of the `.vtu` files, such as `von_mises_MPa`."""
        from pinnray.comparison.report.output_files import field_grid

        return field_grid(self.problem.mesh, self._fields)

    def save(self, path: str | Path) -> Path:
        """Write the fields, and return the path: `.vtu` for ParaView, `.csv` for a table of the triangles.

        Raises:
            UserError: If the name ends otherwise, or nothing can be written there.
        """
        file = as_path(path, "the file")
        try:
            if file.suffix == ".vtu":
                from pinnray.comparison.report.output_files import write_vtu

                write_vtu(file, self.problem.mesh, self._fields)
            elif file.suffix == ".csv":
                from pinnray.runtime.atomic import write_text

                write_text(file, self.to_dataframe().to_csv(index=False, lineterminator="\n"))
            else:
                raise UserError(f"{file}: give a name that ends in .vtu (ParaView) or .csv (a table)")
        except OSError as error:
            raise UserError(f"cannot write {file}: {error.strerror}") from None
        return file

    @cached_property
    def _fields(self) -> "Evaluation":
        """Everything that is drawn and written, on the mesh of the problem."""
        from pinnray.comparison.evaluation.evaluation import Evaluation

        return Evaluation.of(self, self.problem.mesh)
