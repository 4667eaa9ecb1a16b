"""Cameras: intrinsics, lens distortion, calibration boards, bundle adjustment, camera files.

Imports `vision.frames`.
"""
