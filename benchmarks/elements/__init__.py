"""Finite elements against another program, on many ranks, and in the plane against three dimensions."""
