"""A fixed set of problems on which any solver is scored: accuracy, cost, and whether its claims are true.

Imports nothing by itself.
"""
