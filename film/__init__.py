"""Films of a finger: tracking for a comparison, the force in each frame, calibration tables.

Imports `comparison`, which knows a film only as a `comparison.pipeline.job.MarkerSource`.
"""
