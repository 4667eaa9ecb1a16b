"""The report, tables as CSV and for the terminal, `metrics.json` and VTU fields of a comparison.

Imports `compare.evaluation`, `compare.figures`, `compare.runtime`.
"""
