"""Camera films as the input of a comparison: tracking, its files and pictures, calibration tables.

Imports `comparison.figures`, `comparison.evaluation`, `comparison.runtime`.
"""
