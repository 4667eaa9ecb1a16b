"""Marker displacements from cameras, and the files they are kept in. Units: mm, pixels."""
