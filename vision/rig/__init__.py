"""The virtual rig: rendered films of a finger, with known truth. Units: mm, pixels.

Imports `vision.frames`, `vision.calibration`, `vision.tracking` (the workspace).
"""
