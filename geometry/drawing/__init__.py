"""Fingers from drawings: STEP, DXF, SVG and MSH files become sections with a clamp, a contact and markers.

Imports `geometry.finger`, `geometry.mesh`, `geometry.section`; each reader loads its library when it is used.
"""
