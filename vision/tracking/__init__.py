"""Markers through a film: the scene, the fiducials and the markers' plane, data association, displacements.

Imports `vision.frames`, `vision.calibration`, `vision.discs`.
"""
