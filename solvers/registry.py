"""Solvers by name: ours, and other packages' by the entry-point group `pinnray.solvers`."""

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from difflib import get_close_matches
from importlib import import_module
from importlib.metadata import entry_points
from typing import Any, get_type_hints

from pydantic import TypeAdapter, ValidationError

from pinnray.runtime.errors import UserError
from pinnray.solvers.solver import Solver, check_name

GROUP = "pinnray.solvers"

PRESETS = {
    "pinn-std": {
        "fast": "pinnray.solvers.pinn.finite_basis.presets:PinnStdSolver",
        "local": "pinnray.solvers.pinn.finite_basis.presets:PinnLocalSolver",
        "paper": "pinnray.solvers.pinn.paper.solver:PaperPinnSolver",
        "trained": "pinnray.solvers.pinn.finite_basis.presets:TrainedPinnSolver",
    },
    "pinn-asm": {
        "fast": "pinnray.solvers.pinn.finite_basis.presets:PinnAsmSolver",
        "local": "pinnray.solvers.pinn.finite_basis.presets:PinnLocalAsmSolver",
        "paper": "pinnray.solvers.pinn.paper.solver:PaperPinnAsmSolver",
        "trained": "pinnray.solvers.pinn.finite_basis.presets:TrainedPinnAsmSolver",
    },
}
"""Presets of our solvers, the default first. Each is a class with its own settings."""

BUILT_IN = {
    "fem": "pinnray.solvers.fem.linear:FemSolver",
    "fem-nonlinear": "pinnray.solvers.fem.finite_strain.solver:FemNonlinearSolver",
    "fem-3d": "pinnray.solvers.fem.solid:Fem3dSolver",
    "fem-id": "pinnray.solvers.fem.identification:FemIdSolver",
    "fem-asm": "pinnray.solvers.fem.assimilating:FemAsmSolver",
    "gp": "pinnray.solvers.statistics.gaussian_process:GaussianProcessSolver",
    "pinn-std": PRESETS["pinn-std"]["fast"],
    "pinn-asm": PRESETS["pinn-asm"]["fast"],
    "pinn-id": "pinnray.solvers.pinn.identification.solver:PinnIdSolver",
}


DOLFINX = {"dolfinx", "petsc4py", "mpi4py", "ufl", "ffcx", "basix"}
"""Modules that come with DOLFINx."""
DOLFINX_WAYS = (
    '; DOLFINx is set up by make or conda, or by pip install "pinn-ray[fem]" with Python 3.12 or newer'
)


class MissingLibraryError(UserError):
    """A library that a solver needs is missing."""


def solver_names() -> list[str]:
    """Names of all solvers, ours first."""
    return [*BUILT_IN, *sorted({entry.name for entry in entry_points(group=GROUP)} - set(BUILT_IN))]


def solver_modules(names: Iterable[str]) -> list[str]:
    """The modules of our solvers among these names, in their order and without importing them."""
    return list(dict.fromkeys(BUILT_IN[name].partition(":")[0] for name in names if name in BUILT_IN))


def unknown_solver(name: object) -> str:
    """The message for a name that no solver has: near ones, and all of them."""
    names = solver_names()
    word = str(name).lower().replace("_", "-").replace(" ", "-")
    near = [each for each in names if each == word]
    near = near or [each for each in names if each.startswith(f"{word}-")]
    near = near or get_close_matches(word, names, n=1)
    hint = f"; did you mean {' or '.join(map(repr, near))}?" if near else ""
    said = f"no solver is called {name!r}" if name else "no solver was named"
    return f"{said}{hint} (there are: {', '.join(names)})"


def make_solver(name: str, **settings: Any) -> Solver:
    """The solver called `name`, with its settings; `preset` chooses one of its `PRESETS`, if it has any.

    Raises:
        UserError: If there is no such solver or preset, or a package that offers it cannot be loaded.
        MissingLibraryError: If a library that it needs is missing.
    """
    if not isinstance(name, str):
        raise UserError(unknown_solver(name))
    if name in BUILT_IN:
        place = BUILT_IN[name]
        if "preset" in settings and name not in PRESETS:
            raise UserError(f"{name} has no presets; {' and '.join(PRESETS)} have")
        if name in PRESETS and "preset" in settings:
            if (preset := settings.pop("preset")) not in PRESETS[name]:
                raise UserError(f"{name} has no preset {preset!r}; it has {', '.join(PRESETS[name])}")
            place = PRESETS[name][preset]
        module, _, attribute = place.partition(":")
        try:
            factory = getattr(import_module(module), attribute)
        except ImportError as error:
            way = DOLFINX_WAYS if (error.name or "").partition(".")[0] in DOLFINX else ""
            raise MissingLibraryError(f"solver {name!r} cannot be loaded: {error}{way}") from error
    else:
        found = [entry for entry in entry_points(group=GROUP) if entry.name == name]
        if not found:
            raise UserError(unknown_solver(name))
        try:
            factory = found[0].load()
        except Exception as error:
            raise UserError(f"solver {name!r} ({found[0].value}) cannot be loaded: {error}") from error
    typed = _typed(name, factory, settings)
    try:
        solver = factory(**typed)
    except UserError:
        raise
    except Exception as error:  # the constructor of another package may raise anything
        raise UserError(f"solver {name!r} cannot be made with {typed}: {error}") from error
    if not isinstance(solver, Solver):
        interface = "name, laws, loads, solve(problem, progress), settings()"
        raise UserError(f"solver {name!r} does not have the interface: {interface}")
    check_name(solver.name)
    return solver


def usable_solvers() -> dict[str, Solver]:
    """Every solver with its default settings; one that cannot be loaded is left out with a warning."""
    solvers = {}
    for name in solver_names():
        try:
            solvers[name] = make_solver(name)
        except UserError as error:
            warnings.warn(f"solver {name!r} is left out: {error}", stacklevel=2)
    return solvers


def _typed(name: str, factory: Any, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings in the types of the solver's dataclass fields; text from a command line is converted."""
    if not is_dataclass(factory):
        return dict(settings)
    hints = get_type_hints(factory)
    known = [entry.name for entry in fields(factory) if entry.init]
    typed = {}
    for key, value in settings.items():
        if key not in known:
            raise UserError(f"{name} has no setting {key!r}; it has {', '.join(known)}")
        adapter = TypeAdapter(hints[key])
        listed = isinstance(value, str) and value.startswith("[")
        try:
            typed[key] = adapter.validate_json(value) if listed else adapter.validate_python(value)
        except ValidationError as error:
            raise UserError(f"{name}: {key} = {value!r}: {error.errors()[0]['msg'].lower()}") from None
    return typed
