"""Pareto fronts of designs: an emulator proposes fingers, and a solver judges each of them.

Imports `studies.emulator`, `studies.sweep`.
"""
