"""Names of the refused expressions of `geometry`: fingers, drawings, meshes and measurements, each wrong."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from pinnray.geometry import (
    Design,
    MeshSettings,
    Observations,
    TriangleMesh,
    cad_files,
    load_design,
    parse_overrides,
)
from pinnray.geometry.drawing.description import Description, load_description
from pinnray.geometry.drawing.drawn_finger import DrawnFinger
from pinnray.geometry.drawing.formats.msh import _numbers as msh_numbers
from pinnray.geometry.drawing.formats.planes import plane_of
from pinnray.geometry.drawing.load import finger_from_file, read_drawing
from pinnray.geometry.mesh.quadrature import triangle_rule
from pinnray.geometry.picture_frame import Registration
from pinnray.runtime.text_files import read_json, read_toml
from tests.geometry.drawing.files import (
    BEAM,
    FINRAY,
    broken_dxf,
    rectangle,
    write_beam_mesh,
    write_dxf,
    write_svg,
)

__all__ = ["Design", "DrawnFinger", "MeshSettings", "Registration", "cad_files", "load_design"]
__all__ += ["msh_numbers", "parse_overrides", "plane_of", "triangle_rule"]

HOLE = rectangle(40, -7, 10, 4)
BOWTIE = [(0, 0), (100, -10), (100, 0), (0, -10)]
DUMBBELL = [(0, 0), (0, -10), (50, -0.02), (100, -10), (100, 0)]

FILES: dict[str, str | bytes] = {
    "a.stl": "",
    "text.dxf": "no drawing",
    "no value.dxf": "  0\nSECTION\n  2\nHEADER\n  9\n$ACADVER\n  0\nENDSEC\n  0\nEOF\n",
    "no number.dxf": "0\nSECTION\n2\nHEADER\n9\n$EXTMIN\n10\n1\n20\n1\n30\n-1e\n0\nENDSEC\n0\nEOF\n",
    "cut.svg": "<svg",
    "path.svg": '<path xmlns="http://www.w3.org/2000/svg" d="M0 0H60V10H0Z"/>',
    "cut.step": (FINRAY / "Finray_8.stp").read_bytes()[:3000],
    "cut.msh": "$Mesh",
    "head.msh": "$MeshFormat",
    "broken.toml": "height = = 3",
    "utf-16.toml": b"\xff\xfeh\x00",
    "beyond-float.toml": "height = " + "9" * 400,
    "beyond python.toml": "height = " + "9" * 5000,
    "nested.toml": "height = " + "[" * 3000 + "]" * 3000,
    "cut.json": '{"a": [',
    "nested.json": '{"a": ' + "[" * 100_000 + "]" * 100_000 + "}",
}

read_workspace, read_settings = partial(read_json, what="workspace"), partial(read_toml, what="settings")


def read(name: str, **settings: object) -> object:
    """The drawing of a file in this folder."""
    return read_drawing(Path(name), **settings)


def dxf(*curves: Sequence[tuple[float, float]], closed: bool = True, **description: object) -> object:
    """The finger of polygons in a DXF file in mm."""
    return finger_from_file(write_dxf(Path("a.dxf"), curves, closed=closed), Description(**description))


def dxf_in_unit(number: int, size: float) -> object:
    """A rectangle of that width in the unit of that number in the header of a DXF file."""
    path = write_dxf(Path("a.dxf"), [rectangle(0, 0, size, 10)], units=4)
    path.write_text(path.read_text().replace("$INSUNITS\n 70\n4\n", f"$INSUNITS\n 70\n{number}\n"))
    return read_drawing(path)


def changed_dxf(old: str, new: str) -> object:
    """The beam in a DXF file with another text in it."""
    path = write_dxf(Path("a.dxf"), [BEAM])
    path.write_text(path.read_text().replace(old, new))
    return read_drawing(path)


def cut_dxf(share: float) -> object:
    """A share of the beam's DXF file."""
    text = write_dxf(Path("a.dxf"), [BEAM, HOLE]).read_text()
    Path("a.dxf").write_text(text[: int(share * len(text))])
    return read("a.dxf")


def dxf_with(kind: str) -> object:
    """The beam in a DXF file with something that cannot be read."""
    return read_drawing(broken_dxf(Path("a.dxf"), kind))


def svg(body: str, head: str = 'width="100mm" height="60mm" viewBox="0 0 100 60"') -> object:
    """The finger of an SVG file."""
    return finger_from_file(write_svg(Path("a.svg"), body, head))


def msh(*elements: str) -> object:
    """The drawing of a Gmsh mesh with four nodes, the corners of a tetrahedron."""
    nodes = "4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1"
    Path("a.msh").write_text(
        f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{nodes}\n$EndNodes\n"
        + "\n".join(["$Elements", str(len(elements)), *elements, "$EndElements\n"])
    )
    return read("a.msh")


def named_mesh(name: bytes) -> object:
    """The drawing of a mesh with another name in quotes for its contact."""
    path = write_beam_mesh(Path("a.msh"), groups=("base", "contact"))
    path.write_bytes(path.read_bytes().replace(b'"contact"', name))
    return read_drawing(path)


def described(*lines: str) -> Description:
    """The description that lines of a command give."""
    return load_description(None, lines)


def square(**changes: object) -> TriangleMesh:
    """The unit square as two triangles."""
    parts: dict[str, object] = {
        "points": [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        "triangles": [[0, 1, 2], [0, 2, 3]],
        "boundaries": {"base": [[3, 0]], "front": [[2, 3]], "contact": [[2, 3]]},
        "marker_nodes": [1, 2],
        "contact_node": 2,
    }
    return TriangleMesh(**{**parts, **changes})


def observations(**changes: object) -> Observations:
    """Three markers, of which two were seen."""
    parts: dict[str, object] = {
        "points": np.zeros((3, 2)),
        "displacements": np.ones((3, 2)),
        "standard_deviations": np.full((3, 2), 0.01),
        "visible": [True, False, True],
        "source": "a test",
        "simulated": True,
        "marker_radius": 0.8,
    }
    return Observations(**{**parts, **changes})
