"""The finger's parameters and their rules, the validated design, its section in closed form, its markers.

Imports `geometry.arrays`, `geometry.errors`; no CAD, no mesh.
"""
