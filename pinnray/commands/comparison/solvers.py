"""List the solvers."""

from rich.console import Console

PRESET_MEANINGS = {
    "fast": "random hidden weights, output layer solved exactly",
    "local": "the same with small overlapping windows in place of gates",
    "paper": "the paper's training",
    "trained": "small windows, every weight trained",
}


def command() -> int:
    """List the solvers with their material laws, loads, presets and settings.

    The networks pinn-std and pinn-asm have random hidden weights and an output layer that is solved exactly,
    in the preset fast with gates and in the preset local with windows. The preset paper is the paper's
    training; the preset trained is local with fewer windows, whose hidden weights are trained too.
    """
    from rich.table import Table

    from pinnray.solvers.registry import PRESETS, make_solver, usable_solvers

    table = Table("solver", "laws", "loads")
    table.add_column("settings", overflow="fold")
    for name, usual in usable_solvers().items():
        _, *others = PRESETS.get(name, [""])
        for solver in [usual, *(make_solver(name, preset=preset) for preset in others)]:
            settings = [f"{key}={value}" for key, value in solver.settings().items()]
            if meaning := PRESET_MEANINGS.get(str(solver.settings().get("preset"))):
                settings.insert(0, f"({meaning})")
            table.add_row(name, *map("\n".join, (solver.laws, solver.loads, settings)))
    Console().print(table)
    return 0
