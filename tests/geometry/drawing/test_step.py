"""STEP files as CAD programs write them: assemblies, split faces, and planes in any direction."""

from pathlib import Path

import cadquery as cq
import numpy as np
import pytest

from pinnray.geometry import UserError
from pinnray.geometry.cache import drawn_finger
from pinnray.geometry.drawing.checks import body
from pinnray.geometry.drawing.description import Description
from pinnray.geometry.drawing.formats.planes import plane_of, plane_text
from pinnray.geometry.drawing.load import finger_from_file, read_drawing
from tests.geometry.drawing.files import FINRAY

BODY = cq.Solid.makeBox(60, 20, 12)
DISC = cq.Solid.makeCylinder(0.8, 0.6, pnt=cq.Vector(0, 0, 11.4))


at = cq.Location
"""A location by x, y, z, mm, and angles about x, y, z, degrees."""


def exported(path: Path, assembly: cq.Assembly) -> Path:
    assembly.export(str(path / "a.step"))
    return path / "a.step"


def saved(path: Path, solid: cq.Shape) -> Path:
    cq.exporters.export(cq.Workplane(solid), str(path / "a.step"))
    return path / "a.step"


def area(path: Path, **settings: object) -> float:
    return body(read_drawing(path, **settings).loops).area


def test_the_body_and_its_markers_are_where_the_assembly_places_them(tmp_path):
    whole = cq.Assembly(name="press")
    whole.add(cq.Solid.makeBox(60, 20, 12, pnt=cq.Vector(-5, 0, 0)), name="body", loc=at(5, -20, 3))
    for number, x in enumerate((10, 30, 50), start=1):
        whole.add(DISC, name=f"marker-{number}", loc=at(x, -5, 3))
    drawing = read_drawing(exported(tmp_path, whole))
    assert drawing.loops[0].bounds == pytest.approx(np.array([[0, -20], [60, 0]]))
    assert sorted(drawing.markers.round(9).tolist()) == [[10, -5], [30, -5], [50, -5]]
    assert drawing.marker_height == pytest.approx(0.6)


@pytest.mark.parametrize("names", ["marker-1:{}", "Marker-1<{}>", "marker ({})", "MARKER_{}"])
def test_a_part_placed_several_times_in_nested_and_turned_assemblies(tmp_path, names):
    dots = cq.Assembly(name="dots")
    for number, x in enumerate((10, 20, 40), start=1):
        dots.add(DISC, name=names.format(number), loc=at(x, 5, 0))
    inner = cq.Assembly(name="inner").add(dots, name="dots", loc=at(0, 0, 0, 180, 0, 0))  # y, z -> -y, -z
    whole = cq.Assembly(name="whole").add(BODY, name="finger:1", loc=at(0, -10, -12))
    whole.add(inner, name="inner", loc=at(2, 0, 0))
    path = exported(tmp_path, whole)
    drawing = read_drawing(path)
    assert sorted(drawing.markers.round(9).tolist()) == [[12, -5], [22, -5], [42, -5]]
    assert drawing.loops[0].bounds == pytest.approx(np.array([[0, -10], [60, 10]]))
    assert area(path) == pytest.approx(1200)


def test_a_component_called_marker_makes_its_bodies_markers(tmp_path):
    """In Fusion's files `marker-1:1` is a component and `Body1` the solid within it."""
    whole = cq.Assembly(name="marker test").add(BODY, name="body")
    for number in (1, 2):
        part = cq.Assembly(name=f"marker-1:{number}")
        part.add(DISC, name=f"Body{number}", loc=at(20 * number, 5, 0))
        whole.add(part, name=f"marker-1:{number}")
    drawing = read_drawing(exported(tmp_path, whole))
    assert sorted(drawing.markers.round(9).tolist()) == [[20, 5], [40, 5]]


def test_a_whole_that_is_turned_and_mirrored(tmp_path):
    wedge = cq.Workplane("XY").polyline([(0, 0), (60, 0), (60, 4), (0, 20)]).close().extrude(12).val()
    whole = cq.Assembly(name="whole").add(wedge.mirror("YZ"), name="left", loc=at(3, 4, 5, 0, 0, 90))
    drawing = read_drawing(exported(tmp_path, cq.Assembly(name="top").add(whole, loc=at(0, 0, 1, 0, 0, 90))))
    assert body(drawing.loops).area == pytest.approx(60 * 12)
    # mirrored in x, turned by half a turn, shifted
    assert drawing.loops[0].bounds == pytest.approx(np.array([[-4, -17], [56, 3]]))
    corners = drawing.loops[0].points.round(9).tolist()
    assert [56, -1] in corners
    assert [-4, -17] in corners


def test_the_clamp_is_in_the_coordinates_of_the_assembly(tmp_path):
    path = exported(tmp_path, cq.Assembly(name="a").add(BODY, name="body", loc=at(100, 50, 0, 0, 0, 90)))
    finger = finger_from_file(path, Description(clamp=[[80, 50], [100, 50]], contact=[100, 90]))
    assert finger.section.area == pytest.approx(1200)
    assert finger.contact_abscissa == pytest.approx(40)


def test_several_free_parts_of_which_one_is_no_assembly_are_all_read(tmp_path):
    from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer

    writer = STEPControl_Writer()
    for solid in (BODY, BODY.moved(at(0, 50, 0))):
        writer.Transfer(solid.wrapped, STEPControl_StepModelType.STEPControl_AsIs)
    writer.Write(str(tmp_path / "a.step"))
    with pytest.raises(UserError, match="it holds 2 solids besides markers"):
        read_drawing(tmp_path / "a.step")


def split_body() -> cq.Solid:
    """A box whose end faces are split by lines, not its other faces."""
    pieces = [cq.Solid.makeBox(20, 20, 12, pnt=cq.Vector(x, 0, 0)) for x in (0, 20, 40)]
    return pieces[0].fuse(*pieces[1:]).Solids()[0]


def imprinted_body() -> cq.Solid:
    """A block with a disc imprinted into its end face, as for a marker."""
    hole = cq.Workplane("XY").box(60, 20, 12).faces(">Z").workplane().hole(6, 12).val()
    return hole.fuse(cq.Solid.makeCylinder(3, 12, pnt=cq.Vector(0, 0, -6))).Solids()[0]


@pytest.mark.parametrize("solid", [split_body(), imprinted_body()])
def test_end_faces_in_several_coplanar_parts_are_one(tmp_path, solid):
    assert len(solid.Faces()) > 6
    path = saved(tmp_path, solid)
    drawing = read_drawing(path)
    assert drawing.depth == pytest.approx(12)
    assert [abs(loop.area) for loop in drawing.loops] == pytest.approx([1200])
    for offset in ("z = 6", "z = 5"):
        if "5" in offset or solid.BoundingBox().zmin == 0:
            assert area(path, plane=offset) == pytest.approx(1200)


def test_a_plane_in_the_face_of_a_step_gives_one_section(tmp_path):
    low, high = cq.Solid.makeBox(60, 20, 4), cq.Solid.makeBox(30, 20, 8, pnt=cq.Vector(0, 0, 4))
    path = saved(tmp_path, low.fuse(high).Solids()[0])
    assert area(path, plane="z = 4", depth_known=True) == pytest.approx(1200)


@pytest.mark.parametrize(("plane", "expected"), [("z = 12", 1200), ("z = 0", 1200), ("y = 20", 720)])
def test_a_plane_in_an_end_face_is_that_face(tmp_path, plane, expected):
    assert area(saved(tmp_path, BODY), plane=plane) == pytest.approx(expected)


def test_a_plane_that_only_touches_is_refused(tmp_path):
    path = saved(tmp_path, cq.Solid.makeCylinder(10, 30, dir=cq.Vector(1, 0, 0)))
    with pytest.raises(UserError, match="the plane z = 10 only touches the solid; move it into"):
        read_drawing(path, plane="z = 10")


def degenerate(kind: str) -> cq.Shape:
    """A block with a dimple whose tip has no normal."""
    block = cq.Workplane("XY").box(60, 20, 12, centered=False)
    if kind == "cone":
        tip = cq.Solid.makeCone(3, 0, 3, pnt=cq.Vector(20, 10, 12), dir=cq.Vector(0, 0, -1))
    else:
        from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert

        ball = cq.Solid.makeSphere(3, angleDegrees1=-90, angleDegrees2=90)
        ball = cq.Shape.cast(BRepBuilderAPI_NurbsConvert(ball.wrapped, True).Shape())
        tip = ball.moved(at(20, 10, 12))
    return block.cut(cq.Workplane(tip)).val()


@pytest.mark.parametrize("kind", ["cone", "sphere"])
def test_a_face_without_a_normal_somewhere_is_no_hindrance(tmp_path, kind):
    path = saved(tmp_path, degenerate(kind))
    for plane in ("z = 3", None):
        assert area(path, plane=plane) == pytest.approx(1200)
        assert read_drawing(path, plane=plane).depth == pytest.approx(12)


def stepped(kind: str) -> cq.Shape:
    """A bar of 60 mm by 12 mm that is 20 mm deep, and not everywhere."""
    bar = cq.Workplane("XY").box(60, 12, 20)
    hollow = bar.cut(cq.Workplane("XY").box(40, 4, 20))
    return {
        "foot": lambda: bar.union(cq.Workplane("XY").box(8, 16, 40).translate((-34, 0, 0))),
        "foot flush": lambda: bar.union(cq.Workplane("XY").box(8, 16, 40).translate((-34, 0, 10))),
        "thin foot": lambda: hollow.union(cq.Workplane("XY").box(8, 12, 10).translate((-34, 0, 0))),
        "boss": lambda: bar.faces(">Z").workplane().rect(10, 8).extrude(5),
        "step": lambda: bar.cut(cq.Workplane("XY").box(20, 10, 10).translate((25, 0, 10))),
        "chamfer": lambda: bar.edges().chamfer(2),
        "holes across": lambda: bar.faces(">Y").workplane().hole(6).faces(">Z").workplane().hole(4),
        "taper": lambda: cq.Workplane("XY").rect(60, 12).extrude(20, taper=3),
        "sheared": lambda: (
            cq.Workplane("XZ").polyline([(0, 0), (60, 0), (70, 20), (10, 20)]).close().extrude(12)
        ),
        "twisted": lambda: cq.Workplane("XY").rect(60, 12).twistExtrude(20, 20),
    }[kind]().val()


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        (
            "foot",
            "z = 0 its section is 848 mm2 over 20 mm, 128 mm2 over 40 mm, and .* 19520 mm3; .* depth = 20",
        ),
        ("foot flush", "z = 0 its section is 848 mm2 over 20 mm, 128 mm2 over 40 mm"),
        ("thin foot", "656 mm2 over 10 mm, 560 mm2 over 20 mm, and .* 12160 mm3; .* depth = 20"),
        ("boss", "720 mm2 over 20 mm, 80 mm2 over 25 mm"),
        ("step", "720 mm2 over 15 mm, 570 mm2 over 20 mm"),
        ("chamfer", "712 mm2 over 20 mm, and its volume 13707"),
        *((kind, "mm2 over .* mm, and its volume") for kind in ("holes across", "taper", "twisted")),
    ],
)
def test_the_depth_of_a_solid_is_asked_for_unless_its_volume_is_area_times_depth(tmp_path, kind, said):
    path = saved(tmp_path, stepped(kind))
    with pytest.raises(UserError, match=f"a.step: the solid is not extruded: across .*{said}"):
        read_drawing(path)
    with pytest.raises(UserError, match="give the depth of the finger"):
        read_drawing(path, plane="z = 4")
    drawing = read_drawing(path, plane="z = 4", depth_known=True)
    assert "cut, " in drawing.note
    assert f"of a solid of {stepped(kind).Volume():.5g} mm3" in drawing.note


@pytest.mark.parametrize("diameter", [0.5, 6])
def test_a_hole_across_the_middle_is_seen_from_beside_it(tmp_path, diameter):
    bar = cq.Workplane("XY").box(60, 12, 20).cut(cq.Workplane("XY").box(40, 4, 20))
    path = saved(tmp_path, bar.faces(">Y").workplane().hole(diameter).val())
    settings: dict[str, object] = {}
    if diameter == 6:
        with pytest.raises(UserError, match="give the depth of the finger") as asked:
            read_drawing(path)
        settings = {"depth_known": True, "plane": str(asked.value).split('"')[1]}
    assert area(path, **settings) == pytest.approx(560)
    with pytest.raises(UserError, match="at z = 0 it is cut into 2 pieces; give a plane"):
        read_drawing(path, plane="z = 0", depth_known=True)


def test_markers_that_stand_out_do_not_make_the_finger_deeper(tmp_path):
    whole = cq.Assembly(name="whole").add(BODY, name="body")
    whole.add(cq.Workplane("XY").circle(1).extrude(2).translate((0, 9, 11)), name="marker-1")
    drawing = read_drawing(exported(tmp_path, whole))
    assert drawing.depth == pytest.approx(12)
    assert "extruded by 12 mm, at" in drawing.note


def test_a_sheared_solid_is_extruded_along_its_one_straight_direction(tmp_path):
    drawing = read_drawing(saved(tmp_path, stepped("sheared")))
    assert drawing.depth == pytest.approx(12)
    assert body(drawing.loops).area == pytest.approx(1200)


def test_coloured_faces_are_read_like_others(tmp_path):
    """Their labels have no names."""
    whole = cq.Assembly(name="whole").add(BODY, name="body", color=cq.Color("red"))
    for number, face in enumerate(BODY.Faces()):
        whole.children[0].addSubshape(face, color=cq.Color(0.1 * number, 0.5, 0.5))
    assert area(exported(tmp_path, whole)) == pytest.approx(1200)


@pytest.mark.parametrize(
    ("text", "normal", "offset"),
    [
        ("z = 6", [0, 0, 1], 6),
        ("-x=2", [-1, 0, 0], 2),
        ("0.6 x + 0.8 z = 5", [0.6, 0, 0.8], 5),
        ("3x - 4*y = -10", [0.6, -0.8, 0], -2),
        ("X + y + z = 1e1", [3**-0.5] * 3, 10 / 3**0.5),
        (".5z = 3", [0, 0, 1], 6),
    ],
)
def test_planes_in_any_direction(text, normal, offset):
    found, distance = plane_of(text)
    assert found == pytest.approx(normal)
    assert distance == pytest.approx(offset)
    again, same = plane_of(plane_text(found, distance))
    assert again * np.sign(again @ found) == pytest.approx(found, abs=1e-5)
    assert same * np.sign(again @ found) == pytest.approx(distance, rel=1e-5)


def test_a_turned_solid_is_cut_by_a_turned_plane(tmp_path):
    solid = cq.Workplane("XY").box(60, 20, 12).edges("|X").chamfer(0.3).val()
    path = saved(tmp_path, solid.rotate((0, 0, 0), (1, 0, 0), 30))
    drawing = read_drawing(path, plane="-0.5 y + 0.86602540378 z = 0")
    assert body(drawing.loops).area == pytest.approx(1200, rel=1e-6)
    assert drawing.depth == pytest.approx(12, abs=1e-4)


def test_a_damaged_file_is_refused_by_the_worker(tmp_path):
    """OpenCASCADE prints about it to the standard output, on which the child process answers."""
    path = tmp_path / "cut.stp"
    path.write_bytes((FINRAY / "Finray_8.stp").read_bytes()[:3000])
    with pytest.raises(UserError, match="it is damaged or cut off"):
        drawn_finger(path, Description())


def test_no_other_file_is_read(tmp_path, monkeypatch):
    """OpenCASCADE reads the parts of an assembly from files of any folder."""
    from cadquery.occ_impl.exporters.assembly import toCAF
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.STEPControl import STEPControl_StepModelType

    monkeypatch.chdir(tmp_path)
    _, document = toCAF(cq.Assembly(name="whole").add(BODY, name="body"))
    writer = STEPCAFControl_Writer()
    writer.Transfer(document, STEPControl_StepModelType.STEPControl_AsIs, "part-")
    writer.Write("whole.step")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["part-body.stp", "whole.step"]
    with pytest.raises(UserError, match="refers to another file, 'part-body"):
        read_drawing(Path("whole.step"))
