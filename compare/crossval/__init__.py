"""Cross-validation: solvers judged by markers, loads and fields that they were not given.

Imports `compare.evaluation`, `compare.figures`, `compare.report`, `compare.runtime`.
"""
