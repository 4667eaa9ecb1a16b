"""Names of the material laws and of the kinds of load, apart from the models: options need them quickly."""

from typing import Literal

LawName = Literal["linear", "neo-hookean", "st-venant-kirchhoff", "gent"]
"""See `pinnray.solvers.elasticity`."""

LoadKind = Literal["mean", "point", "patch", "cylinder"]
"""See `pinnray.solvers.physics.Load`."""
