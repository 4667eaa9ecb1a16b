"""Misfit to the markers, marker forces, weights, parameter estimation; no finite elements, no networks."""
