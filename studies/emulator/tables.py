"""Predicted fingers as a table with units in the headings."""

from collections.abc import Mapping, Sequence

import pandas as pd

from studies.emulator.emulator import Emulator, Predictions
from studies.sweep.quantities import heading
from studies.sweep.study import Value, title


def table(emulator: Emulator, fingers: Sequence[Mapping[str, Value]], found: Predictions) -> pd.DataFrame:
    """A row for every finger: its varied parameters, and each quantity with the ends of its interval.

    A quantity that is exact for every finger has no columns for the ends.
    """
    columns = {title(name): [finger[name] for finger in fingers] for name in emulator.study.varied}
    for place, name in enumerate(found.names):
        low, high = found.low[:, place], found.high[:, place]
        columns[heading(name)] = found.values[:, place].tolist()
        if (low != high).any():
            columns |= {f"{heading(name)}_low": low.tolist(), f"{heading(name)}_high": high.tolist()}
    return pd.DataFrame(columns)
