"""Emulator of a sweep: its quantities at once for fingers that it did not solve, with intervals.

Imports `studies.sweep`.
"""
