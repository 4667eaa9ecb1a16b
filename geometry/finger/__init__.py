"""The finger's parameters and their rules, the validated design, its section and markers in closed form.

Imports `geometry.arrays`, `geometry.errors`; no CAD, no mesh.
"""
