"""Faults put into every change of a file, and random input."""
