"""Shared parts of assimilating solvers: misfit to the markers, marker forces, weights, parameter estimation.

Imports the problem, the solution and the solver interface; no finite elements, no networks.
"""
