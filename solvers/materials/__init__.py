"""Materials of printed and cast fingers: presets with their sources, and moduli from a tensile test."""

from pinnray.solvers.materials.presets import MATERIALS, MaterialPreset, preset
from pinnray.solvers.materials.tensile_test import TensileFit, TensileTest, fitted, read_tensile_test

__all__ = [
    "MATERIALS",
    "MaterialPreset",
    "TensileFit",
    "TensileTest",
    "fitted",
    "preset",
    "read_tensile_test",
]
