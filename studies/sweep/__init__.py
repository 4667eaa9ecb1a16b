"""A parameter study: sampled fingers, solved by worker processes, and their quantities in one table.

Imports `comparison.figures`, `comparison.evaluation`, `comparison.runtime`.
"""
