"""A rigid `cylinder` with friction against the front face of a finger.

`nodal_contact` adds its forces and their tangent to those of a discretised finger, `front_contact` solves for
them where the finger's compliance at the front is known. `contact_region` tells where it touches.
"""
