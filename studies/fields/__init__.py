"""Whole displacement fields of a study: kept along each sample's load path, and emulated between the samples.

Imports `studies.sweep`.
"""
