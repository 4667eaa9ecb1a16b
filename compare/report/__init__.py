"""The report, tables as CSV and for the terminal, `metrics.json` and VTU fields of a comparison.

Imports `comparison.evaluation`, `comparison.figures`, `comparison.runtime`.
"""
