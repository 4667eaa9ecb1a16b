"""Base of the networks."""

from typing import ClassVar

from pinnray.solvers.solver import Family, FieldSettings


class NetworkSolver(FieldSettings):
    """A solver by a network; `MarkerWeights` are the settings of one that assimilates."""

    family: ClassVar[Family] = "neural network"
    laws: ClassVar[tuple[str, ...]] = ("linear",)
    loads: ClassVar[tuple[str, ...]] = ("mean", "point")
