"""Gmsh meshes of every version, and what other programs leave in them."""

from pathlib import Path

import gmsh
import numpy as np
import pytest

from pinnray.geometry import UserError
from pinnray.geometry.drawing.checks import body
from pinnray.geometry.drawing.load import read_drawing
from pinnray.geometry.mesh.mesher import session


def write_mesh(
    path: Path,
    *,
    version: float = 4.1,
    order: int = 1,
    depth: float = 12.0,
    far: bool = False,
    binary: bool = False,
    size: float = 6.0,
    quads: bool = False,
) -> Path:
    """A block of 60 mm by 20 mm with a round hole, plane without a depth; `far` adds a point beside it."""
    with session():
        gmsh.model.add("block")
        outer = gmsh.model.occ.addRectangle(0, 0, 0, 60, 20)
        hole = gmsh.model.occ.addDisk(30, 10, 0, 4, 4)
        (surface,), _ = gmsh.model.occ.cut([(2, outer)], [(2, hole)])
        if depth:
            gmsh.model.occ.extrude([surface], 0, 0, depth, numElements=[2], recombine=quads)
        if far:
            gmsh.model.occ.addPoint(-80, 15, 40)
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        gmsh.option.setNumber("Mesh.SaveAll", 1)
        if quads:
            gmsh.option.setNumber("Mesh.RecombineAll", 1)
        gmsh.model.mesh.generate(3 if depth else 2)
        gmsh.model.mesh.setOrder(order)
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", int(binary))
        gmsh.write(str(path))
    return path


def facets(path: Path) -> float:
    """Area of the block with the hole as a polygon, from the mesh of first order."""
    return body(read_drawing(path).loops).area


@pytest.mark.parametrize(
    ("version", "binary"), [(1.0, False), (2.2, False), (2.2, True), (4.0, False), (4.1, False), (4.1, True)]
)
@pytest.mark.parametrize("depth", [0.0, 12.0])
def test_every_version_of_the_format_is_read(tmp_path, version, depth, binary):
    drawing = read_drawing(write_mesh(tmp_path / "a.msh", version=version, depth=depth, binary=binary))
    assert drawing.depth == (pytest.approx(12) if depth else None)
    assert body(drawing.loops).area == pytest.approx(1200 - 16 * np.pi, rel=0.01)


@pytest.mark.parametrize("depth", [0.0, 12.0])
@pytest.mark.parametrize("kind", [{"quads": True}, {"order": 2}])
def test_other_elements_are_refused(tmp_path, depth, kind):
    path = write_mesh(tmp_path / "b.msh", depth=depth, **kind)
    with pytest.raises(UserError, match=r"it holds elements of type .*; there may be triangles and tetra"):
        read_drawing(path)


@pytest.mark.parametrize("version", [1.0, 2.2, 4.1])
@pytest.mark.parametrize("depth", [0.0, 12.0])
def test_a_construction_point_outside_the_body_is_no_part_of_it(tmp_path, depth, version):
    path = write_mesh(tmp_path / "a.msh", depth=depth, version=version, far=True)
    drawing = read_drawing(path)
    assert drawing.depth == (pytest.approx(12) if depth else None)
    assert body(drawing.loops).bounds == pytest.approx(np.array([[0, 0], [60, 20]]))


@pytest.mark.parametrize("start", [b"\xef\xbb\xbf", b"\n\n", b"\r\n "])
def test_a_byte_order_mark_and_blank_lines_are_no_damage(tmp_path, start):
    path = write_mesh(tmp_path / "a.msh")
    expected = facets(path)
    path.write_bytes(start + path.read_bytes())
    assert facets(path) == pytest.approx(expected)


@pytest.mark.parametrize("version", [1.0, 2.2, 4.1])
@pytest.mark.parametrize("share", [0.2, 0.7, 0.99])
def test_a_file_that_was_cut_off_is_refused_for_that(tmp_path, share, version):
    path = write_mesh(tmp_path / "a.msh", version=version)
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(
        UserError, match=r"it ends before \$(EndElements|ENDELM), so that it was cut off; save"
    ):
        read_drawing(path)


@pytest.mark.parametrize("start", [b"$NODES\n", b"Merge 'a';\n", b"$ELM\n", b"\xff\xfe$\0M\0"])
def test_other_files_are_not_given_to_gmsh(tmp_path, start):
    (tmp_path / "a.msh").write_bytes(start + b"\n$EndElements\n")
    with pytest.raises(UserError, match="it is no Gmsh mesh: its first line is not"):
        read_drawing(tmp_path / "a.msh")
