"""The networks with default settings on fingers from drawings and on the preset csiro, as on random designs.

Run it in a clone of the repository: the drawings are those of its tests. Allow fifteen minutes.
"""

from pathlib import Path

from rich.table import Table

from benchmarks.networks_on_designs import compared
from geometry.drawing.load import load_drawing
from geometry.finger.finger import Finger
from geometry.finger.presets import load_design

DATA = Path(__file__).parent.parent / "tests" / "data"
DRAWINGS = (
    *sorted((DATA / "compliant-finray").glob("*.stp")),
    DATA / "csiro-finger" / "finray_test_vol.msh",
)


def main() -> Table:
    """Train and compare."""
    fingers: dict[str, Finger] = {path.stem: load_drawing(path) for path in DRAWINGS}
    return compared("Networks on drawings", fingers | {"preset csiro": load_design("csiro")})
