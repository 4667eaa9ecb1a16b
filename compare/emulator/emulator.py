"""The emulator of a sweep: fitted to its samples, kept in its folder, asked for any finger in its range."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from compare.runtime.stages import Stages
from compare.sweep.study import Study, Value
from geometry.arrays import FloatArray


@dataclass(frozen=True)
class Predictions:
    """Predicted quantities of n fingers.

    Attributes:
        names: Of the q quantities, in the order of `compare.sweep.quantities.QUANTITIES`.
        values: Predictions, shape (n, q), in the quantities' units.
        low: Lower ends of the 95 % intervals, shape (n, q); the value itself where it is exact.
        high: Upper ends, shape (n, q).
    """

    names: tuple[str, ...]
    values: FloatArray
    low: FloatArray
    high: FloatArray

    def column(self, name: str) -> FloatArray:
        """Predictions of one quantity, shape (n,)."""
        return self.values[:, self.names.index(name)]


class Emulator:
    """Predicts the quantities of a study's fingers; made by `emulator_of`.

    Attributes:
        study: The study.
        names: The quantities that it predicts.
    """

    study: Study
    names: tuple[str, ...]

    def fault(self, finger: Mapping[str, Value]) -> str | None:
        """The reason why it does not predict a finger: range, unknown or missing parameter, broken rule."""
        raise NotImplementedError

    def predict(
        self, fingers: Sequence[Mapping[str, Value]], names: Sequence[str] | None = None
    ) -> Predictions:
        """Predict quantities of fingers given by the study's varied parameters.

        Args:
            fingers: Values of every varied parameter; see `fault`, which is not asked again.
            names: Quantities; None means all. Those that follow from the section alone (`area`, `mass`,
                `thinnest_wall`, `narrowest_gap`) are exact, and take most of the time.
        """
        raise NotImplementedError


def emulator_of(folder: Path, *, refit: bool = False, stages: Stages | None = None) -> Emulator:
    """The emulator of a sweep's folder: the one that is kept there, or fitted and kept.

    Args:
        folder: Of the sweep.
        refit: Fit again although the one kept there is of the same samples.
        stages: Shows the progress of a fit.

    Raises:
        UserError: If the folder holds no sweep, too few samples, or a study that cannot be emulated.
    """
    raise NotImplementedError
