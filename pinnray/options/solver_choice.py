"""Solvers by their names, with a preset and settings; and which of them a comparison may leave out."""

from collections.abc import Collection, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from pinnray.runtime.errors import UserError
from pinnray.solvers.registry import PRESETS, make_solver
from pinnray.solvers.solver import Solver


def made_solvers(
    names: Sequence[str],
    preset: str | None = None,
    settings: Mapping[str, Mapping[str, object]] = MappingProxyType({}),
    **shared: object,
) -> list[Solver]:
    """The solvers with these names.

    Args:
        names: Their names.
        preset: For those that have it.
        settings: Of single solvers, by their names.
        shared: Settings of all solvers that have them.

    Raises:
        UserError: If there is no such solver or setting, or none has the preset.
    """
    having = [name for name in names if preset in PRESETS.get(name, ())]
    if preset is not None and not having:
        known = "; ".join(f"{name} has {', '.join(presets)}" for name, presets in PRESETS.items())
        said = f"{', '.join(names)} {'do' if len(names) > 1 else 'does'} not have it"
        said = said if names else "it is for solvers that are given by their names"
        raise UserError(f"preset {preset}: {said} ({known})")
    made = []
    for name in names:
        own: dict[str, Any] = {"preset": preset} if name in having else {}
        own |= settings.get(name, {})
        usual = make_solver(name, **own).settings()
        made.append(make_solver(name, **{each: shared[each] for each in shared if each in usual} | own))
    return made


def spare_solvers(
    solvers: Sequence[Solver], reference: str | None, preset: str | None, named: Collection[str] = ()
) -> list[str]:
    """Names of the solvers that a comparison leaves out where they cannot do the job.

    Args:
        solvers: All of them.
        reference: The one to compare with, which is asked for.
        preset: What is asked for of those that have it.
        named: Others that are asked for.
    """
    asked = {reference, *named}
    if preset is not None:
        asked |= {solver.name for solver in solvers if solver.settings().get("preset") == preset}
    return [solver.name for solver in solvers if solver.name not in asked]
