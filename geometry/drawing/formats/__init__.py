"""Readers of STEP, DXF, SVG and MSH files into closed curves of lines and arcs with labels.

CadQuery, ezdxf, svgelements and Gmsh are imported in `step`, `dxf`, `svg` and `msh` alone.
"""
