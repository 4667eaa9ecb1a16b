"""The finger's section and solid in CadQuery, and the section as SVG.

Imports `geometry.finger`.
"""
