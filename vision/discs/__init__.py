"""Disc markers in one image: colour, circle proposals, sub-pixel centres with covariances.

Imports `vision.frames`.
"""
