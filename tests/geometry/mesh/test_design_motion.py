"""A mesh that follows the parameters of its design."""

import pytest

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.design_motion import MovingMesh
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.runtime.errors import UserError

SHORT = Design(height=50, rib_count=1, tip_length=12, contact_position=20)


def test_the_mesh_follows_every_parameter_of_its_section():
    """Its area stays that of the section, arcs too: a node keeps its place on its piece."""
    design = SHORT.replaced(tip_radius=2.0, fillet_radius=0.5)
    mesh = finger_mesh(design, settings=MeshSettings(size=1.0))
    other = design.replaced(rib_thickness=2.1, fillet_radius=0.6, height=50.5, contact_position=20.3)
    moved = MovingMesh(mesh, design).of(other)
    chords = mesh.areas.sum() - design.section.area  # straight edges on arcs
    assert moved.areas.sum() - other.section.area == pytest.approx(chords, abs=0.2 * abs(chords))
    assert moved.points[moved.contact_node] == pytest.approx([20.0, 0.0], abs=1e-9)
    with pytest.raises(UserError, match="other pieces"):
        MovingMesh(mesh, design).of(design.replaced(fillet_radius=0.0))
    with pytest.raises(UserError, match="the mesh is not of the finger"):
        MovingMesh(mesh, SHORT)
