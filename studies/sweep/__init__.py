"""A parameter study: sampled fingers, solved by worker processes, and their quantities in one table.

Imports `compare.figures`, `compare.evaluation`, `compare.runtime`.
"""
