"""Verification of the finite elements: closed forms, manufactured and published solutions, another program.

`python -m benchmarks.verification` measures every case and writes docs/verification.md; pytest runs them too.
"""
