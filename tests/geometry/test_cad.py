"""CAD against the closed forms, and its files against an independent reader where there is one."""

from pathlib import Path

import cadquery as cq
import numpy as np
import pytest

from pinnray.geometry import Design, MeshSettings, cad, cad_files, load_design, marker_positions
from pinnray.geometry.mesh.mesher import build_mesh


def test_face_has_the_area_and_the_holes_of_the_closed_form(design: Design) -> None:
    face = cq.Face.makeFromWires(*cad._wires(design))
    assert face.isValid()
    assert face.Area() == pytest.approx(design.section.area, rel=1e-9)
    assert len(face.innerWires()) == design.rib_count + 1
    perimeter = sum(wire.Length() for wire in [face.outerWire(), *face.innerWires()])
    assert perimeter == pytest.approx(sum(loop.lengths.sum() for loop in design.section.loops), rel=1e-9)


@pytest.mark.parametrize(
    "design",
    [
        Design(),  # sharp corners
        Design(fillet_radius=1.0, depth=12, marker_layout="front", marker_height=2),
    ],
)
def test_body_and_markers_together_are_the_extruded_section(design: Design) -> None:
    body, markers = cad.solids(design)
    parts = [body, *markers]
    volumes = np.array([part.Volume() for part in parts])
    heights = np.array([part.Center().z for part in parts])
    assert all(part.isValid() for part in parts)
    assert volumes.sum() == pytest.approx(design.section.area * design.depth, rel=1e-9)
    assert (volumes * heights).sum() / volumes.sum() == pytest.approx(design.depth / 2, rel=1e-9)
    disc = np.pi / 4 * design.marker_diameter**2 * design.marker_height
    np.testing.assert_allclose(volumes[1:], disc, rtol=1e-9)


def test_markers_are_inlaid_flush_with_the_side_face() -> None:
    design = Design()
    body, markers = cad.solids(design)
    assert len(markers) == 9
    for marker, (x, y) in zip(markers, marker_positions(design), strict=True):
        box = marker.BoundingBox()
        assert (box.zmin, box.zmax) == pytest.approx((design.depth - 0.6, design.depth), abs=1e-6)
        assert (marker.Center().x, marker.Center().y) == pytest.approx((x, y), abs=1e-9)
        assert marker.intersect(body).Volume() == pytest.approx(0, abs=1e-9)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("cad")
    files = cad_files(Design(), folder / "out")
    return {file.name: file for file in files}


def stl_volume(path: Path) -> float:
    """Volume inside the facets by the divergence theorem, mm^3; binary or text STL."""
    content = path.read_bytes()
    if content[:5] == b"solid":
        lines = [line.split()[1:] for line in content.decode().splitlines() if "vertex" in line]
        corners = np.array(lines, dtype=float).reshape(-1, 3, 3)
    else:
        facet = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
        corners = np.frombuffer(content, dtype=facet, offset=84)["corners"].astype(float)
    return float(np.einsum("ni,ni->n", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6)


def test_stl_files_enclose_the_volumes(written: dict[str, Path]) -> None:
    discs, body = 9 * np.pi / 4 * 1.6**2 * 0.6, 20 * Design().section.area
    assert stl_volume(written["finger-markers.stl"]) == pytest.approx(discs, rel=0.01)  # facets of circles
    assert stl_volume(written["finger-body.stl"]) == pytest.approx(body - discs, rel=1e-4)


@pytest.mark.parametrize(
    "design", [Design(fillet_radius=1.0), load_design("csiro")], ids=["fillets", "csiro"]
)
def test_the_mesh_has_its_boundary_on_the_cad_face(design: Design) -> None:
    """Gmsh gets the section without CAD: both are the same geometry."""
    mesh = build_mesh(design, MeshSettings(size=2.0))
    face = cq.Face.makeFromWires(*cad._wires(design))
    assert face.Area() == pytest.approx(design.section.area, rel=1e-12)
    wires = cq.Compound.makeCompound([face.outerWire(), *face.innerWires()])
    nodes = mesh.points[np.unique(mesh.boundary_edges)]
    assert max(wires.distance(cq.Vertex.makeVertex(x, y, 0)) for x, y in nodes) < 1e-9
