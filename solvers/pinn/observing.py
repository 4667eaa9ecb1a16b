"""What a network is told of the markers: nothing, or their misfit, which it minimises with the energy."""

from dataclasses import dataclass
from typing import ClassVar

from solvers.assimilation import MARKER_RADIUS, Misfit, Weighting, check_weighting, misfit_of
from solvers.problem import Problem
from solvers.weight_choice import Choice, WeightChoice

WEIGHING = ("weights", "asm_weight", "scale", "marker_radius")
"""The settings of `Assimilating`."""
ASSIMILATION = (*WEIGHING, "choose")
"""Those of `ChoosingWeights`."""


class Observing:
    """A network that is told nothing of the markers."""

    name: ClassVar[str]

    def __post_init__(self) -> None:
        """There are no settings to check."""

    def misfit(self, problem: Problem) -> Misfit | None:
        """The misfit that is added to the energy, if any."""
        return None

    @property
    def choice(self) -> WeightChoice:
        """How the factor of its weights is chosen."""
        return WeightChoice("given", None)


@dataclass(frozen=True, kw_only=True)
class Assimilating(Observing):
    """A network that is given the markers.

    Attributes:
        weights: "paper" or "precision": how the markers are weighed, see `misfit_of`.
        asm_weight: The paper's λ_ASM, MPa/mm², for "paper".
        scale: The model's own error as an energy per depth, N mm/mm, for "precision".
        marker_radius: Of the disc over which a marker takes the mean displacement, mm; 0 for its centre.
    """

    weights: Weighting = "paper"
    asm_weight: float = 1000.0
    scale: float = 1.0
    marker_radius: float = MARKER_RADIUS
    assimilates: ClassVar[bool] = True

    def __post_init__(self) -> None:
        super().__post_init__()
        check_weighting(self.name, self.weights, self.asm_weight, self.scale, self.marker_radius)

    def misfit(self, problem: Problem) -> Misfit | None:
        """The misfit to the problem's observations, if it has any; see `misfit_of`."""
        return misfit_of(problem, **{setting: getattr(self, setting) for setting in WEIGHING})


@dataclass(frozen=True, kw_only=True)
class ChoosingWeights(Assimilating):
    """A network that is given the markers and knows its minimiser for all weights at once.

    Attributes:
        choose: "given", "left-out" or "evidence": which factor of the weights is taken, see `WeightChoice`.
    """

    choose: Choice = "given"

    def __post_init__(self) -> None:
        super().__post_init__()
        _ = self.choice

    @property
    def choice(self) -> WeightChoice:
        """How the factor of the weights is chosen."""
        return WeightChoice.of(self.name, self.choose, self.weights, self.scale)
