"""Faults put into every change of a file, random and mutated input, and mutants of the code."""
