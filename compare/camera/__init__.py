"""Camera films as the input of a comparison: tracking, its files and pictures, calibration tables.

Imports `compare.figures`, `compare.evaluation`, `compare.runtime`.
"""
