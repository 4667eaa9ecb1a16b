"""Cross-validation: solvers scored at markers, loads and fields that they were not given.

Imports `comparison.evaluation`, `comparison.figures`, `studies.sweep`.
"""
