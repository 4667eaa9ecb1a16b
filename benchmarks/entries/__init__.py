"""Solvers of other libraries as entries of `pinnray benchmark`, a short file each, and its references."""
