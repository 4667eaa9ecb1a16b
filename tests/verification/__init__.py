"""Verification of the finite elements: closed forms, manufactured and published solutions, another program.

`python -m tests.verification` measures every case and writes docs/verification.md; pytest runs the cases too.
"""
