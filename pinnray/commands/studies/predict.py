"""Predict a finger from a sweep."""

from pathlib import Path

from rich.console import Console

from pinnray.options.shared import Repeated


def command(sweep: Path, *, set: Repeated = ()) -> int:
    """Predict the quantities of a finger that a sweep did not solve, each with a 95 % interval.

    An emulator is fitted to the sweep's converged samples the first time, and again when there are more. It
    takes numbers within their ranges and choices among those of the sweep; a sweep of a drawing is refused.

    Args:
        sweep: Folder of `pinnray sweep`.
        set: A parameter that the sweep varies, such as rib_count=6 or N=6; give every one.
    """
    from pinnray.geometry.finger.presets import assignments
    from pinnray.runtime.stages import Stages
    from pinnray.runtime.tables import terminal_table
    from pinnray.solvers.finger_figures import QUANTITIES
    from pinnray.studies.emulator.store import emulator_of

    given = assignments(set)
    with Stages() as stages:
        emulator = emulator_of(sweep, stages)
    found = emulator.predict([emulator.inputs.finger(given)])
    headings = ["quantity", "unit", "value", "95 % interval", "meaning"]
    rows = []
    for name, ((value,), (low,), (high,)) in found.items():
        ends = "exact" if low == high else f"{low:.4g} to {high:.4g}"
        rows.append([name, QUANTITIES[name].unit, f"{value:.4g}", ends, QUANTITIES[name].meaning])
    title = f"{emulator.study.name}: predicted from {emulator.count:,} samples"
    shown = terminal_table(title, headings, rows, left=["quantity", "unit", "meaning"])
    for column in shown.columns:
        column.no_wrap, column.overflow = column.header != "meaning", "fold"
    Console().print(shown)
    return 0
