"""Validation: predictions of finite elements beside measurements of real bodies.

`python -m benchmarks validation` computes everything and writes docs/validation.md with its picture.
"""
