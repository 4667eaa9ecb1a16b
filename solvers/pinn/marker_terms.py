"""What a network is told of the markers: nothing, or their misfit, which it minimises with the energy."""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from geometry.errors import UserError
from solvers.assimilation.marker_weight import Choice, WeightChoice
from solvers.assimilation.misfit import Misfit, Weighting, check_weighting, misfit_of
from solvers.problem import Problem

WEIGHING = ("weights", "asm_weight", "scale", "marker_radius")
"""The settings of `Assimilating`."""
ASSIMILATION = (*WEIGHING, "contact_deviation", "choose")
"""Those of `ChoosingWeights`."""


class Given(NamedTuple):
    """What a network is given beside its problem's conditions.

    Attributes:
        misfit: To the markers, with weights that are not all zero.
        choice: How a factor of the weights is chosen.
        slack: Compliance of springs between contact and indenter, mm per N/mm.
    """

    misfit: Misfit
    choice: WeightChoice
    slack: float = 0.0


class Observing:
    """A network that is told nothing of the markers."""

    name: ClassVar[str]

    def __post_init__(self) -> None:
        """There are no settings to check."""

    def misfit(self, problem: Problem) -> Misfit | None:
        """The misfit that is added to the energy, if any."""
        return None

    def given(self, problem: Problem) -> Given | None:
        """The same with how it is to be minimised, of a network whose output layer is solved exactly."""
        return None


@dataclass(frozen=True, kw_only=True)
class Assimilating(Observing):
    """A network that is given the markers.

    Attributes:
        weights: "paper" or "precision": how the markers are weighed, see `misfit_of`.
        asm_weight: The paper's λ_ASM, MPa/mm², for "paper".
        scale: The model's own error as an energy per depth, N mm/mm, for "precision".
        marker_radius: Radius of the disc over which a marker takes the mean displacement, mm; None: that of
            the observations; 0: its centre.
    """

    weights: Weighting = "paper"
    asm_weight: float = 1000.0
    scale: float = 1.0
    marker_radius: float | None = None
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
        contact_deviation: Standard deviation of the contact's displacement about what is prescribed, mm,
            where the prior is exp(-E / scale); zero: the contact moves as prescribed.
        choose: "given", "left-out" or "evidence": which factor of the weights is taken, see `WeightChoice`.
    """

    contact_deviation: float = 0.0
    choose: Choice = "given"

    def __post_init__(self) -> None:
        super().__post_init__()
        _ = self.choice
        if not 0 <= self.contact_deviation < np.inf:
            raise UserError(
                f"{self.name}: contact_deviation must be zero or more, got {self.contact_deviation} (mm)"
            )

    @property
    def choice(self) -> WeightChoice:
        """How the factor of the weights is chosen."""
        return WeightChoice.of(self.name, self.choose, self.weights, self.scale)

    def given(self, problem: Problem) -> Given | None:
        """The misfit and how it is to be minimised; None without markers, or with weights of zero.

        Raises:
            UserError: If weights are to be chosen at finite strain, or a patch is to have a deviation.
        """
        misfit = self.misfit(problem)
        if misfit is None or not self.asm_weight * self.scale:
            return None
        if problem.material.law != "linear" and self.choose != "given":
            raise UserError(f"{self.name}: choose={self.choose} is for the linear law; take given")
        if problem.load.kind == "patch" and self.contact_deviation:
            raise UserError(
                f"{self.name}: every point of a patch moves as prescribed; contact_deviation must be 0"
            )
        return Given(misfit, self.choice, self.contact_deviation**2 / self.scale)
