"""Plane sections of any body: closed curves of lines and arcs with named pieces, in closed form.

Imports `geometry.arrays`, `geometry.errors`; no CAD, no mesh.
"""
