"""The cases, in the order of the page."""

from benchmarks.verification.another_program import ANOTHER_PROGRAM
from benchmarks.verification.calculix import CALCULIX
from benchmarks.verification.cantilever import CANTILEVER
from benchmarks.verification.cook import COOK
from benchmarks.verification.finite_strain import FINITE_STRAIN
from benchmarks.verification.hertz import HERTZ
from benchmarks.verification.locking import LOCKING
from benchmarks.verification.manufactured import MANUFACTURED
from benchmarks.verification.patch import PATCH
from benchmarks.verification.plate_with_hole import KIRSCH
from benchmarks.verification.solid import SOLID

CASES = (
    PATCH,
    MANUFACTURED,
    CANTILEVER,
    COOK,
    KIRSCH,
    LOCKING,
    ANOTHER_PROGRAM,
    FINITE_STRAIN,
    CALCULIX,
    HERTZ,
    SOLID,
)
