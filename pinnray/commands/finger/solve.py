"""Solve one finger with one solver."""

from dataclasses import replace
from math import hypot, isfinite, isnan, nan
from pathlib import Path
from typing import TYPE_CHECKING

from pinnray.options.shared import (
    FingerOptions,
    OutputPath,
    PhysicsOptions,
    PressOptions,
    SolverOptions,
    comma_list,
    existing_table,
)
from pinnray.runtime.errors import UserError
from pinnray.runtime.exits import NOT_CONVERGED, say

if TYPE_CHECKING:
    from pinnray.solvers.finger_figures import FingerFigures


def command(
    solver: str | None = None,
    *,
    finger: FingerOptions = FingerOptions(),
    physics: PhysicsOptions = PhysicsOptions(),
    options: SolverOptions = SolverOptions(),
    taught: PressOptions = PressOptions(),
    measurements: Path | None = None,
    strokes: str | None = None,
    out: OutputPath = Path("out/solution.vtu"),
) -> int:
    """Solve one finger with one solver, write its fields and say what the finger does.

    Args:
        solver: Name of a solver; `pinnray solvers` lists them.
        measurements: CSV file of marker displacements, for an assimilating solver.
        strokes: Strokes at which to print the force, mm, separated by commas; default: the full one.
        out: VTU file of the fields.
    """
    from pinnray.comparison.evaluation.evaluation import evaluated
    from pinnray.comparison.evaluation.force_curves import force_curves, write_force_displacement
    from pinnray.comparison.figures.force_charts import draw_force_displacement
    from pinnray.comparison.report.output_files import write_vtu
    from pinnray.functions import solve
    from pinnray.geometry.drawing.drawn_finger import finger_lines
    from pinnray.geometry.finger.learned import check_target, write_learned
    from pinnray.solvers.finger_figures import break_answer
    from pinnray.solvers.registry import make_solver, unknown_solver
    from pinnray.vision.measurements import parse_weighed, read_measurements

    if not solver:
        raise UserError(unknown_solver(solver))
    chosen, settings = finger.read(options.preset)
    material, load = physics.read(options.preset)
    travel = float(hypot(*load.values))
    at_strokes = [_stroke(text, travel) for text in comma_list(strokes or "")]
    if out.suffix != ".vtu":
        raise UserError(f"--out {out}: the fields are a VTU file; give a name that ends in .vtu")
    if out.is_dir():
        raise UserError(f"--out {out}: this is a folder; name a file that ends in .vtu")
    chosen_solvers = options.read(solver)
    if len(chosen_solvers) != 1:
        raise UserError(f"name one solver, not {solver!r}; `compare` takes several")
    (made,) = chosen_solvers
    if at_strokes and "stops" in made.settings():
        stops = [min(each / travel, 1.0) for each in at_strokes]
        made = make_solver(made.name, **made.settings() | {"stops": stops})
    file = existing_table(measurements)
    seen = None if file is None else read_measurements(file, marker_radius=chosen.marker_radius)
    if taught.learn is not None:
        check_target(taught.learn)
    if taught.weighed is not None and seen is not None:
        seen = replace(seen, weighed=parse_weighed(taught.weighed))
    if seen is None and (taught.weighed or taught.presses or taught.learn):
        raise UserError("--presses, --weighed and --learn belong to a measured finger; give --measurements")
    finger.check_cost(chosen, settings, [made])
    solution = solve(
        chosen,
        made,
        size=settings,
        material=material,
        load=load,
        measurements=seen,
        presses=taught.files,
        learned=finger.learned(),
        progress=True,
    )
    mesh = solution.problem.mesh
    evaluation = evaluated(solution, mesh)
    figures = evaluation.figures
    forces = [(stroke, _force(figures, stroke)) for stroke in at_strokes] if figures else []
    write_vtu(out, mesh, evaluation)
    written = [out]
    if curves := force_curves([evaluation], load):
        written += [out.with_name(f"{out.stem}_force_displacement.{kind}") for kind in ("csv", "png")]
        write_force_displacement(written[1], curves, depth=chosen.depth)
        draw_force_displacement(curves, depth=chosen.depth).save(written[2])
    print(f"{evaluation.label}: {evaluation.message}")
    print(f"energy {solution.energy:.6g} N mm/mm")
    if figures:
        print("\n".join(_lines(figures, forces)))
        print(break_answer(figures.strain_over_break, figures.peak_radius))
    if found := solution.identified:
        print(found.advice)
        if taught.learn is not None and found.learned is not None and solution.status.converged:
            write_learned(taught.learn, found.learned, finger_lines(chosen))
            written.append(taught.learn)
    print(*written, sep="\n")
    whole = all(isfinite(force) for _, force in forces)
    return 0 if evaluation.converged and whole else NOT_CONVERGED


def _stroke(text: str, travel: float) -> float:
    """A stroke, mm, of a load that goes as far as a travel, mm."""
    try:
        stroke = float(text)
    except ValueError:
        raise UserError(f"--strokes {text}: give lengths in mm, such as 2,5,10") from None
    if not 0 <= stroke <= travel * (1 + 1e-9):
        raise UserError(
            f"--strokes {text}: the stroke ends at {travel:.6g} mm; give lengths up to it, or a longer one"
        )
    return stroke


def _force(figures: "FingerFigures", stroke: float) -> float:
    """The force at a stroke, N; where it is not known, NaN and a warning."""
    try:
        return figures.force_at(stroke)
    except UserError as error:
        say(f"warning: {error}")
        return nan


def _lines(figures: "FingerFigures", forces: list[tuple[float, float]]) -> list[str]:
    """One solver's figures, a line each, after the forces, N, at some strokes, mm."""
    rows = [
        ("force", "not known" if isnan(force) else f"{force:.4g} N", f"at {stroke:g} mm")
        for stroke, force in forces
    ]
    rows += figures.rows()
    widths = [max(len(row[column]) for row in rows) for column in (0, 1)]
    return [f"{name:<{widths[0]}}  {value:<{widths[1]}}  {remark}".rstrip() for name, value, remark in rows]
