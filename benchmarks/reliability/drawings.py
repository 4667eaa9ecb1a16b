"""Random drawings as programs write them: each read to 1e-6 of its area, or refused in one line.

`python -m benchmarks.reliability.drawings COUNT [SEED] [FORMAT]` makes DXF, SVG and STEP files of random
sections: blocks, units, hidden layers, copies, placements and gaps; solids with bosses, steps,
feet, pockets, holes, chamfers and coloured faces. What a refusal proposes (`units`, `tolerance`, `depth`)
must work. Areas, volumes and distances of markers are computed here, without the readers' code.
"""

import re
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import ezdxf
import numpy as np
from ezdxf.document import Drawing

from pinnray.geometry.drawing.checks import body
from pinnray.geometry.drawing.load import read_drawing
from pinnray.runtime.errors import UserError

SAME = 1e-6
"""Largest relative difference of areas and of the markers' distances."""
LEFT_OUT = 0.005
"""Share of a solid's volume that its section times its depth may leave out or add."""
FEATURES = ("markers", "markers", "plain", "boss", "foot", "step", "pocket", "hole", "hole across", "chamfer")
"""Of solids; there are no others with markers."""
LENGTHS = {0: 1.0, 1: 25.4, 2: 304.8, 4: 1.0, 5: 10.0, 6: 1000.0, 9: 0.0254, 10: 914.4}
"""Units of DXF headers, mm."""
UNITS = {"mm": 1.0, "cm": 10.0, "in": 25.4, "pt": 25.4 / 72, "": 25.4 / 96}
"""Units of SVG files, mm."""
DEPTH, RADIUS = 12.0, 0.4
"""Of solids, and of markers, mm."""


class Curve(NamedTuple):
    """Corners (n, 2), mm, and the bulge of the piece after each, as in DXF."""

    points: np.ndarray
    bulges: np.ndarray

    @property
    def area(self) -> float:
        """Area by the corners and the circular segments, mm^2."""
        (x, y), (z, w) = self.points.T, np.roll(self.points, -1, axis=0).T
        chord, angle = np.hypot(z - x, w - y), 4 * np.arctan(self.bulges)
        bent = np.abs(self.bulges) > 0
        radius = np.divide(chord, 2 * np.sin(angle / 2), out=np.zeros_like(chord), where=bent)
        return float(0.5 * (x * w - z * y).sum() + (0.5 * radius**2 * (angle - np.sin(angle))).sum())


class Truth(NamedTuple):
    """What the reader of a file must find beside the section."""

    gap: float = 0.0  # between ends of lines, mm
    volume: float = 0.0  # of the solid, mm^3; zero for a drawing
    kind: str = ""  # of the solid


class Sketch(NamedTuple):
    """A section: its outline, cavities and markers (m, 2), mm."""

    outline: Curve
    cavities: tuple[Curve, ...]
    markers: np.ndarray

    @property
    def area(self) -> float:
        """Area of the body, mm^2."""
        return self.outline.area - sum(each.area for each in self.cavities)


def straight(*points: tuple[float, float]) -> Curve:
    """A polygon."""
    return Curve(np.array(points), np.zeros(len(points)))


def sketch(random: np.random.Generator) -> Sketch:
    """A section with up to five cavities and four markers."""
    x, y = random.uniform(40, 120), random.uniform(12, 30)
    r = 0.02 * 100 ** random.random()
    if random.random() < 0.5:
        outline = straight((0, 0), (x, y - 11), (x, y), (0, y))
    else:
        corners = [[r, 0], [x - r, 0], [x, r], [x, y - r], [x - r, y], [r, y], [0, y - r], [0, r]]
        outline = Curve(np.array(corners), np.tile([0.0, np.tan(np.pi / 8)], 4))
    count = int(random.integers(6))
    room = min(4.0, 0.3 * x / max(count, 1))
    middles = (np.arange(count) + 0.5) * x / max(count, 1)
    cavities = tuple(_cavity(random, middle, y - 6, room) for middle in middles)
    markers = np.stack([x * np.array([0.2, 0.4, 0.6, 0.85]), np.full(4, y - 1.2)], axis=1)
    return Sketch(outline, cavities, markers[: int(random.integers(5))])


def _cavity(random: np.random.Generator, x: float, y: float, room: float) -> Curve:
    size = random.uniform(0.3, 1) * room
    if random.random() < 0.5:
        return Curve(np.array([[x + size, y], [x - size, y]]), np.ones(2))
    return straight((x - size, y - size), (x + size, y - size), (x + size, y), (x, y + size))


def plain(sketch: Sketch, length: float = 1.0, units: int = 0) -> Drawing:
    """A DXF document of a sketch in a unit of some length, mm."""
    document = ezdxf.new(units=units)
    for curve in (sketch.outline, *sketch.cavities):
        corners = np.column_stack([curve.points / length, curve.bulges])
        document.modelspace().add_lwpolyline(corners.tolist(), format="xyb", close=True)
    return document


def dxf(random: np.random.Generator, sketch: Sketch, path: Path) -> Truth:
    """A DXF file: some unit, nested, turned and mirrored blocks, lines with gaps, and a hidden frame."""
    number = int(random.choice(list(LENGTHS)))
    length = 1.0 if random.random() < 0.2 else LENGTHS[number]  # the header's unit may be a lie
    scales = random.choice([0.5, 1, 2], random.integers(4))
    unit = length * scales.prod()
    document = plain(sketch, unit, number)
    space, gap = document.modelspace(), 0.0
    if random.random() < 0.5:
        gap = float(random.choice([0.0, 0.002]))
        for line in [piece for curve in list(space) for piece in curve.explode()]:  # type: ignore[attr-defined]
            if gap and line.dxftype() == "LINE":
                line.dxf.start += (line.dxf.end - line.dxf.start).normalize(gap / unit)
    on, way = {"layer": "markers"}, random.integers(3)
    for at in (sketch.markers / unit).tolist():
        if way == 0:
            space.add_point(at, dxfattribs=on)
        for start, end in {1: [(0, 360)], 2: [(0, 180), (180, 360)]}.get(way, []):
            space.add_arc(at, RADIUS / unit, start, end, dxfattribs=on)
    for level, scale in enumerate(scales):
        block = document.blocks.new(f"block {level}")
        for entity in list(space):
            space.move_to_layout(entity, block)
        flipped = {"xscale": scale * random.choice([-1, 1]), "yscale": scale, "zscale": scale}
        turned = flipped | {"rotation": random.uniform(0, 360)}
        space.add_blockref(block.name, random.uniform(-50, 50, 2), dxfattribs=turned)
    document.layers.add("off").off()
    space.add_lwpolyline([(-9, -9), (500, -9), (500, 300)], close=True, dxfattribs={"layer": "off"})
    document.saveas(path)
    return Truth(gap=gap * 2)


def svg(random: np.random.Generator, sketch: Sketch, path: Path) -> Truth:
    """An SVG file: some unit, transformed, also through copies, beside what is not drawn."""
    unit = str(random.choice(list(UNITS)))
    scale = float(random.choice([0.5, 1, 3]))
    turn = f"rotate({random.uniform(0, 360):.9g}) scale({random.choice([-1, 1]) * scale} {scale})"
    content = elements(sketch, scale * UNITS[unit])
    copied = f'<defs>{content}</defs><g transform="{turn}"><use href="#finger" y="-7"/></g>'
    content = copied if random.random() < 0.5 else f'<g transform="{turn}">{content}</g>'
    size = f'width="400{unit}" height="300{unit}" ' if unit else ""
    head = f'xmlns="http://www.w3.org/2000/svg" {size}viewBox="-200 -100 400 300"'
    path.write_text(f"<svg {head}><path/><clipPath><circle r='300'/></clipPath>{content}</svg>")
    return Truth()


def elements(sketch: Sketch, length: float = 1.0) -> str:
    """The body and the markers of a sketch in SVG, in a unit of some length, mm."""
    text = ""
    for curve in (sketch.outline, *sketch.cavities):
        ends = np.roll(curve.points, -1, axis=0)
        text += "M{:.15g} {:.15g}".format(*curve.points[0] / length)
        for start, end, bulge in zip(curve.points, ends, curve.bulges, strict=True):
            radius = np.linalg.norm(end - start) * (1 + bulge**2) / (4 * bulge) / length if bulge else 0.0
            text += f"A{radius:.15g} {radius:.15g} 0 0 1 " if bulge else "L"
            text += "{:.15g} {:.15g}".format(*end / length)
        text += "Z"
    dots = "".join(
        f'<circle cx="{x:.12g}" cy="{y:.12g}" r="{RADIUS / length:.12g}"/>'
        for x, y in sketch.markers / length
    )
    return f'<g id="finger"><path d="{text}"/><g id="markers">{dots}</g></g>'


def step(random: np.random.Generator, sketch: Sketch, path: Path) -> Truth:
    """A STEP file: an assembly of assemblies, moved and turned, of a solid with a feature or with markers."""
    import cadquery as cq

    plain(sketch).saveas(path.with_suffix(".dxf"))
    section = cq.importers.importDXF(str(path.with_suffix(".dxf"))).wires().toPending()
    solid = section.extrude(DEPTH).val()
    kind = str(random.choice(FEATURES))
    shaped = featured(random, kind, solid, *np.ptp(sketch.outline.points, axis=0))
    place = cq.Location(*random.uniform(-50, 50, 2), 0, 0, 0, random.uniform(0, 360))
    whole, inner = cq.Assembly(name="whole"), cq.Assembly(name="inner")
    body = shaped.moved(place.inverse)
    inner.add(body, name="body:1", loc=place, color=cq.Color(*random.random(3)))
    for face in random.permutation(np.array(body.Faces(), dtype=object))[: random.integers(9)]:
        named = {"name": "face"} if random.random() < 0.3 else {"color": cq.Color(*random.random(3))}
        inner.children[0].addSubshape(face, **named)
    disc = cq.Solid.makeCylinder(RADIUS, 0.5)
    for number, (x, y) in enumerate(sketch.markers if kind == "markers" else (), start=1):
        inner.add(disc, name=f"marker-1:{number}", loc=cq.Location(x, y, DEPTH - 0.5))
    turned = cq.Location(*random.uniform(-20, 20, 3), 0, *random.uniform(0, 360, 2))
    whole.add(inner, name="inner:1", loc=turned)
    whole.export(str(path))
    return Truth(volume=shaped.Volume(), kind=kind)


def featured(random: np.random.Generator, kind: str, solid: Any, x: float, y: float) -> Any:
    """A solid with one of `FEATURES` of any size."""
    import cadquery as cq

    at, size, vector = random.uniform(0.2, 0.7) * x, 0.02 * 200 ** random.random(), cq.Vector
    box, cylinder = cq.Solid.makeBox, cq.Solid.makeCylinder
    wedge = box(20, 3 * y, 20).rotate(vector(), vector(0, 1, 0), 45)
    whole = {
        "boss": lambda: solid.fuse(cylinder(2, size, vector(at, y - 2, DEPTH))),
        "foot": lambda: solid.fuse(box(4, y, DEPTH + 2 * size, vector(-3, 0, -size))),
        "step": lambda: solid.cut(box(0.2 * x, 3 * y, size, vector(at, -y, DEPTH - size))),
        "pocket": lambda: solid.cut(cylinder(1, size, vector(at, y - 2, DEPTH - size))),
        "hole": lambda: solid.cut(cylinder(0.7, DEPTH, vector(at, y - 1, 0))),
        "hole across": lambda: solid.cut(cylinder(size / 2, 3 * y, vector(at, -y, 6), vector(0, 1, 0))),
        "chamfer": lambda: solid.cut(wedge.moved(cq.Location(x, -y, DEPTH - size))),
    }.get(kind, lambda: solid)()
    return whole.Solids()[0] if len(whole.Solids()) == 1 else solid


WRITERS: dict[str, Callable[[np.random.Generator, Sketch, Path], Truth]] = {
    "dxf": dxf,
    "svg": svg,
    "step": step,
}
"""By suffix."""


def outcome(path: Path, expected: Sketch, truth: Truth) -> tuple[str, str]:
    """`read`, `read as proposed`, `refused` or `wrong`, and the refusal or what is wrong."""
    settings, said = dict[str, Any](), ""
    if truth.kind not in ("", "markers"):
        expected = expected._replace(markers=np.empty((0, 2)))
    for _ in range(4):
        try:
            drawing = read_drawing(path, **settings)
            found = body(drawing.loops)
        except UserError as error:
            said = str(error)
            if "the solid is not extruded" in said:
                return "depth asked for", said
            remedy = re.search(r'(units|tolerance) = "?([a-z]+|[0-9.e-]+)', said)
            if "\n" in said or (remedy and remedy[1] in settings):
                return "wrong", f"after {settings}: {said}"
            if not remedy:
                return "refused", said
            settings[remedy[1]] = float(remedy[2]) if remedy[1] == "tolerance" else remedy[2]
            continue
        except Exception as error:
            return "wrong", f"{type(error).__name__}: {error}"
        volume = found.area * (drawing.depth or 0.0)
        if truth.volume and abs(volume / truth.volume - 1) > LEFT_OUT:
            return "wrong", f"{volume:.6g} for {truth.volume:.6g} mm3; {drawing.note}"
        exact = abs(volume / truth.volume - 1) < SAME if truth.volume else False
        if not len(expected.markers) and (exact or abs((drawing.depth or DEPTH) - DEPTH) > 0.01):
            return "read", said  # with a hole, or across another direction, as of a bar
        if fault := _difference(found.area, drawing.markers, expected, truth.gap):
            return "wrong", f"{fault}; {drawing.note}"
        return ("read as proposed" if said else "read"), said
    return "wrong", said


def _difference(area: float, markers: np.ndarray, expected: Sketch, gap: float) -> str:
    """What differs, in words; empty if nothing does."""
    perimeter = 2 * float(np.ptp(expected.outline.points, axis=0).sum())
    if abs(area - expected.area) > SAME * expected.area + gap * perimeter:
        return f"area {area:.9g} for {expected.area:.9g} mm2"
    found, right = (
        np.sort(np.linalg.norm(each[:, None] - each, axis=2).ravel()) for each in (markers, expected.markers)
    )
    if found.shape != right.shape:
        return f"{len(markers)} markers for {len(expected.markers)}"
    return "markers elsewhere" if np.abs(found - right).max(initial=0) > SAME * 100 else ""


def tried(
    count: int, seed: int = 0, formats: Sequence[str] = tuple(WRITERS)
) -> tuple[Counter[tuple[str, str]], list[str]]:
    """Numbers of drawings by format and outcome, and the wrong ones in words."""
    counts, wrong = Counter[tuple[str, str]](), list[str]()
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            random = np.random.default_rng([seed, number])
            suffix = formats[number % len(formats)]
            drawn = sketch(random)
            path = Path(folder) / f"{number}.{suffix}"
            truth = WRITERS[suffix](random, drawn, path)
            state, said = outcome(path, drawn, truth)
            counts[f"{suffix} {truth.kind}".rstrip(), state] += 1
            if state in ("wrong", "refused"):
                wrong += [f"{path.name}: {said}"] * (state == "wrong")
                print(path.name, state, said, flush=True)
    return counts, wrong


if __name__ == "__main__":
    print(tried(int(sys.argv[1]), *map(int, sys.argv[2:3]), *([sys.argv[3:]] if sys.argv[3:] else []))[0])
