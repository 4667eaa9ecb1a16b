"""Materials of printed and cast fingers: presets with their sources, and moduli from a tensile test."""

from pinnray.solvers.materials.presets import MATERIALS as MATERIALS
from pinnray.solvers.materials.presets import MaterialPreset as MaterialPreset
from pinnray.solvers.materials.presets import preset as preset
from pinnray.solvers.materials.tensile_test import TensileFit as TensileFit
from pinnray.solvers.materials.tensile_test import TensileTest as TensileTest
from pinnray.solvers.materials.tensile_test import fitted as fitted
from pinnray.solvers.materials.tensile_test import read_tensile_test as read_tensile_test
