"""The cases, in the order of the page."""

from benchmarks.verification.cases.another_program import ANOTHER_PROGRAM
from benchmarks.verification.cases.calculix import CALCULIX
from benchmarks.verification.cases.calculix_contact import CALCULIX_CONTACT
from benchmarks.verification.cases.cantilever import CANTILEVER
from benchmarks.verification.cases.cook import COOK
from benchmarks.verification.cases.finite_strain import FINITE_STRAIN
from benchmarks.verification.cases.friction import FRICTION
from benchmarks.verification.cases.hertz import HERTZ
from benchmarks.verification.cases.locking import LOCKING
from benchmarks.verification.cases.manufactured import MANUFACTURED
from benchmarks.verification.cases.patch import PATCH
from benchmarks.verification.cases.plate_with_hole import KIRSCH
from benchmarks.verification.cases.solid import SOLID

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
    FRICTION,
    CALCULIX_CONTACT,
    SOLID,
)
