"""The cases, in the order of the page."""

from tests.verification.another_program import ANOTHER_PROGRAM
from tests.verification.cantilever import CANTILEVER
from tests.verification.cook import COOK
from tests.verification.finite_strain import FINITE_STRAIN
from tests.verification.hertz import HERTZ
from tests.verification.locking import LOCKING
from tests.verification.manufactured import MANUFACTURED
from tests.verification.patch import PATCH
from tests.verification.plate_with_hole import KIRSCH

CASES = (PATCH, MANUFACTURED, CANTILEVER, COOK, KIRSCH, LOCKING, ANOTHER_PROGRAM, FINITE_STRAIN, HERTZ)
