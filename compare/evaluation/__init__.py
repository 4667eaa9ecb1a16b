"""Solutions sampled on the shared mesh, their certificate, metrics, and the virtual experiment.

Imports `comparison.runtime`.
"""
