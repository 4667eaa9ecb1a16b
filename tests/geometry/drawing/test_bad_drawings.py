"""Messages for drawings and descriptions that are no finger: one line each."""

from pathlib import Path

import numpy as np
import pytest

from geometry import UserError
from geometry.cache import drawn_finger
from geometry.drawing.description import Description, load_description
from geometry.drawing.load import finger_from_file, read_drawing
from tests.geometry.drawing.files import BEAM, FINRAY, rectangle, write_dxf, write_svg

HOLE = rectangle(40, -7, 10, 4)
BOWTIE = [(0, 0), (100, -10), (100, 0), (0, -10)]
DUMBBELL = [(0, 0), (0, -10), (50, -0.02), (100, -10), (100, 0)]


def refused(path: Path, message: str, **description: object) -> None:
    """Reading a drawing fails in one line that names the file."""
    with pytest.raises(UserError, match=message) as error:
        finger_from_file(path, Description(**description))
    assert str(error.value).startswith(f"{path.name}: ")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("curves", "description", "message"),
    [
        # what is drawn
        ([[*BEAM, (0.5, 0)]], {"_open": True}, "is open at .*: a gap of 0.5 mm"),
        ([BOWTIE], {}, r"crosses or touches itself at \(50, -5\)"),
        ([BEAM, rectangle(40, 20, 5, 5)], {}, "a body of its own outside the outline"),
        ([BEAM, rectangle(40, -12, 5, 6)], {}, r"the cavity at \(4[05], .*crosses the outline at"),
        ([BEAM, rectangle(40, -10, 5, 6)], {}, r"the cavity at .* touches the outline at"),
        ([BEAM, HOLE, rectangle(45, -6, 10, 2)], {}, "crosses the cavity at"),
        ([BEAM, HOLE, rectangle(50, -6, 10, 2)], {}, "touches the cavity at"),
        ([BEAM, HOLE, rectangle(42, -6, 2, 2)], {}, "is inside the cavity at"),
        ([BEAM, HOLE, HOLE], {}, "is drawn twice"),
        ([BEAM, BEAM], {}, "is drawn twice"),
        ([DUMBBELL], {"clamp": [[0, 0], [0, -10]]}, r"the wall at \(.*\) is 0.0\d* mm thin"),
        ([BEAM, rectangle(40, -5, 1e-5, 1e-5)], {}, "is smaller than 0.001 mm; delete"),
        # units
        ([[(x / 1e5, y / 1e5) for x, y in BEAM]], {}, 'give units = "m" for 1 mm'),
        ([BEAM], {"units": "m"}, r'measures 1e\+05 mm, not 1 to 2000 mm; give units = "mm" for 100 mm'),
        # the clamp
        ([BEAM], {"clamp": "jaw"}, "nothing is clamped: no piece of the outline is called 'jaw'"),
        ([BEAM], {"clamp": [[0, 0], [0, 0]]}, "has no length"),
        ([BEAM], {"clamp": [[-3, 0], [0, -10]]}, r"base at \(-3, 0\) is 3 mm off the outline; its nearest"),
        # the contact
        ([BEAM], {"contact": "tip"}, "no contact: no piece of the outline is called 'tip'"),
        ([BEAM], {"contact": [40, 2]}, r"contact at \(40, 2\) is 2 mm off .* nearest point is \(40, 0\)"),
        ([BEAM], {"contact": [0, -5]}, "is on the clamp"),
        ([BEAM], {"contact": [100, 0]}, "is on a corner"),
        ([BEAM], {"contact": [99.5, 0], "contact_width": 4}, "x = 101.5 mm is not on the front face"),
        # the markers
        ([BEAM, HOLE], {"markers": [[45, -5]]}, r"marker 1 at \(45, -5\) is outside the body"),
        ([BEAM], {"markers": [[20, -5], [50, 3]]}, "marker 2 at .* is outside the body"),
        ([BEAM], {"markers": [[20, -0.5]], "marker_diameter": 2}, "less than its radius of 1 mm"),
        ([BEAM], {"markers": [[20, -5], [20, -5]]}, "markers 1 and 2 are both at"),
        ([BEAM], {"markers": "dots"}, "has no markers called 'dots'"),
    ],
)
def test_message(tmp_path, curves, description, message):
    settings = dict(description)
    path = write_dxf(tmp_path / "bad.dxf", curves, closed=not settings.pop("_open", False))
    refused(path, message, **settings)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (["contact = 35"], "contact = 35: no point"),
        (["contact = [nan, 0]"], "no point"),
        (["clamp = [[0, 0], [inf, 0]]"], "no pair of points"),
        (["markers = [[1, nan]]"], "no points"),
        (["clamp = [1, 2]"], "no pair of points; write clamp"),
        (["clamp = [[[0, 0], [1, 0], [2, 0]]]"], "no pair of points"),
        (["markers = 0"], "outside its range, 1 to 200"),
        (["markers = [[1, 2, 3]]"], "no points"),
        (["depth = -1"], "depth = -1 is outside its range"),
        (['units = "furlong"'], "units = 'furlong'"),
        (["contakt = [1, 2]"], "unknown parameter 'contakt'; did you mean contact"),
        (["contact [1, 2]"], "cannot read 'contact"),
    ],
)
def test_description_message(lines, message):
    with pytest.raises(UserError, match=message) as error:
        load_description(None, lines)
    assert "\n" not in str(error.value)


def test_description_file(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text("contact = [1, 2]\nclamp = [[0, 0], [0, 1]]")
    found = load_description(path, ["contact = [3, 4]", "markers = 4"])
    assert (found.contact, found.markers) == ((3, 4), 4)
    assert found.clamp == (((0, 0), (0, 1)),)
    path.write_text("contact = ")
    with pytest.raises(UserError, match="cannot read the description"):
        load_description(path)
    with pytest.raises(UserError, match="cannot read the description"):
        load_description(tmp_path / "none.toml")


@pytest.mark.parametrize(
    "text",
    [
        "  0\nSECTION\n  2\nHEADER\n  9\n$ACADVER\n  0\nENDSEC\n  0\nEOF\n",  # a variable without a value
        "  0\nSECTION\n  2\nHEADER\n  9\n$EXTMIN\n 10\n1\n 20\n1\n 30\n-1e\n  0\nENDSEC\n  0\nEOF\n",
    ],
    ids=["no value", "no number"],
)
def test_a_damaged_header_of_a_dxf_file_is_one_line(tmp_path, text):
    (tmp_path / "a.dxf").write_text(text)
    refused(tmp_path / "a.dxf", "it cannot be read as DXF")


HEAD = 'width="100mm" height="60mm" viewBox="0 0 100 60"'
FAR = r"a coordinate is not finite or beyond 1e\+07 mm; draw the section near"
BOX = "is not four numbers with width and height"
MARKED = '<rect width="50" height="9"/><g id="markers">{}</g>'


@pytest.mark.timeout(20)  # a curve that is halved for ever would take all time
@pytest.mark.parametrize(
    ("head", "body", "message"),
    [
        (HEAD, '<path d="M0 0C0 9 1e999 9 30 0L0 10Z"/>', FAR),  # infinite
        (HEAD, '<path d="M0 0C0 9 1e300 9 30 0L0 10Z"/>', FAR),
        (HEAD, '<ellipse cx="1e15" cy="5" rx="20" ry="9"/>', FAR),
        (HEAD, '<path d="M1e12 0h60v10h-60Z"/>', FAR),
        (HEAD, '<rect transform="scale(1e999)" width="60" height="9"/>', "of a rect without an id is not"),
        (HEAD, '<ellipse transform="scale(1e999)" rx="60" ry="9"/>', "of an ellipse without an id is not"),
        (
            'width="10E" height="10E"',
            '<path d="M0 0H9V9Z"/>',
            "width = '10E' is no length of paper; write such as 60mm, or give",
        ),
        ('width="-10"', '<path d="M0 0H9V9Z"/>', "'-10' is no width or height"),
        *(
            (f'viewBox="{box}"', "", f"'{box}' {BOX}")
            for box in ("0 0 0 0", "nan nan nan nan", "0 0 60", "all")
        ),
        (HEAD, '<path d="M 0 0 H nan V 10 H 0 Z"/>', "a coordinate of a path without an id is no number"),
        (
            'width="30mm" height="(0m1" viewBox="0 0 30 10"',
            '<path d="M0 0H30L0 10Z"/>',
            r"height = '\(0m1' is no length of paper",
        ),
        ("", '<path t="M0 0H30L0 10Z"/>', "there is no line or arc in it"),  # no data
        ("", '<path id="a" d="V0L0 10Z"/>', "the attribute d of 'a' has no sound"),  # nowhere to start from
        ("", '<path d="V0L0 10Z"/>', "the attribute d of a path without an id has no sound value"),
        # svgelements takes any sign for the # before a name
        *((HEAD, f'<g id="a"><use href="{sign}a"/><rect/></g>', "element contains itself") for sign in "#'"),
        (HEAD, '<g id="contact"><rect width="20" height="5" rx="0.2"/></g>', "call only the part contact"),
        (HEAD, MARKED.format('<rect width="1" height="1"/>'), "is no circle"),
        (
            HEAD,
            MARKED.format('<circle cx="9" cy="4" r="1"/><circle cx="19" cy="4" r="2"/>'),
            "have diameters from 2 to 4 mm",
        ),
    ],
)
def test_svg_message(tmp_path, head, body, message):
    refused(write_svg(tmp_path / "a.svg", body, head), message)


def test_the_outermost_element_must_be_svg(tmp_path):
    path = tmp_path / "a.svg"
    path.write_text('<path xmlns="http://www.w3.org/2000/svg" d="M0 0H60V10H0Z"/>')
    refused(path, "it cannot be read as SVG: its outermost element is path")


def test_an_unknown_entity_of_a_dxf_file_is_named(tmp_path):
    path = write_dxf(tmp_path / "a.dxf", [BEAM])
    path.write_text(path.read_text().replace("LWPOLYLINE", "LVPOLYLINE"))
    refused(path, "cannot read the LVPOLYLINE on layer")


def test_copies_of_copies_are_counted_before_they_are_made(tmp_path):
    """Thirty lines would make a thousand million rectangles."""
    levels = "".join(f'<g id="g{n + 1}">{2 * f"""<use href="#g{n}"/>"""}</g>' for n in range(30))
    path = write_svg(tmp_path / "a.svg", f'<g id="g0"><rect width="9" height="3"/></g>{levels}')
    refused(path, r"it cannot be read as SVG: its copies make \d+ elements")


def test_a_drawing_of_which_all_is_called_front_is_read(tmp_path):
    """What is named may lie on the boundary, but here it is the boundary."""
    path = write_svg(tmp_path / "a.svg", '<g id="front"><rect width="60" height="9"/></g>')
    finger = finger_from_file(path, Description(clamp=[[0, 0], [0, -9]], contact=[40, 0]))
    assert np.ptp(finger.section.outline.points, axis=0) == pytest.approx([60, 9])


def test_a_step_file_that_was_cut_off_is_one_line(tmp_path):
    """OpenCASCADE prints about it to the standard output, on which the child process answers."""
    path = tmp_path / "cut.stp"
    path.write_bytes((FINRAY / "Finray_8.stp").read_bytes()[:3000])
    with pytest.raises(
        UserError, match=r"cut\.stp: it cannot be read as STEP: it is damaged or cut off; export"
    ):
        drawn_finger(path, Description(), cache_dir=tmp_path / "cache")


def test_a_step_file_reads_no_other_file(tmp_path, monkeypatch):
    """OpenCASCADE reads the parts of an assembly from files of any folder."""
    import cadquery as cq
    from cadquery.occ_impl.exporters.assembly import toCAF
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.STEPControl import STEPControl_StepModelType

    monkeypatch.chdir(tmp_path)
    _, document = toCAF(cq.Assembly(name="whole").add(cq.Workplane().box(60, 10, 20), name="body"))
    writer = STEPCAFControl_Writer()
    writer.Transfer(document, STEPControl_StepModelType.STEPControl_AsIs, "part-")
    writer.Write("whole.step")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["part-body.stp", "whole.step"]
    with pytest.raises(UserError, match=r"whole\.step: it refers to another file, 'part-body\.stp'"):
        read_drawing(Path("whole.step"))


def test_plane_must_be_a_plane():
    with pytest.raises(UserError, match=r'cannot read the plane .*"z = 6"'):
        finger_from_file(FINRAY / "Finray_8.stp", Description(plane="middle"))


def test_everything_clamped(tmp_path):
    path = write_dxf(tmp_path / "a.dxf", [BEAM])
    corners = np.array(BEAM)
    pairs = [[a.tolist(), b.tolist()] for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    with pytest.raises(UserError, match="whole outline is clamped"):
        finger_from_file(path, Description(clamp=pairs))
