"""What the options of `pinnray crossval` stand for."""

from math import inf

from compare.commands.options import FingerOptions, SolverOptions
from compare.crossval.fold_results import SolverVariant
from compare.crossval.folds import ALL, SCHEMES
from geometry.errors import UserError
from geometry.finger.design import Design
from geometry.mesh.settings import MeshSettings
from solvers.problem import Material
from solvers.solver import with_law

SIZE = 0.5
"""Of elements unless something else is asked for, mm.

`fem` knows the markers to 0.01 mm on them, a hundredth of what it is wrong by; the truth's are half as large.
"""

CHOICES = {"left-out": {"weights": "precision", "choose": "left-out"}}
CHOICES |= {"evidence": {"weights": "precision", "choose": "evidence"}}
"""Variants of a solver that can choose the weights of the markers, beside the paper's weight as it is."""


def read_entries(options: SolverOptions, names: str, material: Material) -> list[SolverVariant]:
    """The solvers, and those that can choose their weights once more for each way of choosing.

    The choice is made inside a fold, by the markers that are given. Where --solver-set says how to choose, or
    the law is not linear, there is that one only.
    """
    told = {text.partition("=")[0] for text in options.solver_set}
    entries = []
    for solver in options.read(names):
        settings = solver.settings()
        entries.append(SolverVariant(solver.name, solver.name, settings))
        chosen = told & {f"{solver.name}.choose", f"{solver.name}.weights"}
        if "choose" in settings and not chosen and with_law(material, solver).law == "linear":
            entries += [
                SolverVariant(f"{solver.name} {choice}", solver.name, {**settings, **changes})
                for choice, changes in CHOICES.items()
            ]
    if not entries:
        raise UserError("no solver was asked for; name at least one")
    return entries


def read_finger(finger: FingerOptions, preset: str | None) -> tuple[Design, MeshSettings]:
    """The design and the mesh settings, coarser than usual unless something else is asked for."""
    design, mesh = finger.read(preset)
    if finger.mesh_size is None and preset is None:
        mesh = mesh.model_copy(update={"size": SIZE})
    return design, mesh


def read_schemes(text: str) -> list[str]:
    """Names of schemes with commas between them."""
    held = [scheme for scheme in SCHEMES if scheme != ALL]
    names = [name.strip() for name in text.split(",") if name.strip()]
    if unknown := next((name for name in names if name not in held), None):
        raise UserError(f"--schemes: there is no scheme {unknown!r}; there are {', '.join(held)}")
    if not names or len(set(names)) < len(names):
        raise UserError(f"--schemes {text}: name at least one of {', '.join(held)}, none twice")
    return names


def check_draws(seeds: int, noise: float) -> None:
    """Refuse numbers that make no sense."""
    if seeds < 1:
        raise UserError(f"--seeds {seeds}: give a whole number from 1")
    if not 0 <= noise < inf:
        raise UserError(f"--noise {noise:g}: give a standard deviation of zero or more, mm")
