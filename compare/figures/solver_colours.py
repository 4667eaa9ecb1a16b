"""The colour and the mark of a solver, the same in every picture."""

from typing import NamedTuple
from zlib import crc32

from pinnray.runtime.figure import MUTED


class Look(NamedTuple):
    """A colour and matplotlib's name of a mark."""

    colour: str
    mark: str


LOOKS = {
    "fem": Look("#006ba1", "o"),
    "fem-nonlinear": Look("#365e0d", ">"),
    "pinn-std": Look("#e46b28", "^"),
    "pinn-asm": Look("#1bbce4", "v"),
    "fem-asm": Look("#431b6b", "D"),
    "fem-id": Look("#000000", "p"),
    "pinn-id": Look("#94c979", "h"),
    "gp": Look("#946bf2", "P"),
}
"""Each colour differs from the others, and from that of measurements, for readers of any colour vision.

The least distance in CAM02-UCS is 22; it is 14, 13 and 12 with deuteranopia, protanopia and tritanopia, and
6 in grey.
"""


def solver_look(solver: str) -> Look:
    """Colour and mark of a solver by its name; others than ours are grey."""
    return LOOKS.get(solver) or Look(MUTED, "<dH8*"[crc32(solver.encode()) % 5])
