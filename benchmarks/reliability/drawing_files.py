"""Writes sections as DXF, SVG, STEP and MSH files, dressed as programs dress them."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import ezdxf
import numpy as np

if TYPE_CHECKING:
    from benchmarks.reliability.drawings import Curve, Drawn, Sketch

LENGTHS = {0: 1.0, 1: 25.4, 2: 304.8, 4: 1.0, 5: 10.0, 6: 1000.0, 9: 0.0254, 10: 914.4}
LENGTHS |= {13: 1e-3, 14: 100.0}
"""Units of DXF headers, mm."""


def _drawn(*values: Any) -> "Drawn":
    from benchmarks.reliability.drawings import Drawn

    return Drawn(*values)


def dxf(random: np.random.Generator, sketch: "Sketch", path: Path) -> "Drawn":
    """A DXF file: some unit, nested, turned and mirrored blocks, lines in any order, and hidden frames."""
    number = int(random.choice(list(LENGTHS)))
    lies = random.random() < 0.2  # the header's unit is not the drawing's
    length = 1.0 if lies else LENGTHS[number]
    gap = float(random.choice([0.0, 0.0, 0.002, 0.01])) if len(sketch.outline.points) < 50 else 0.0
    document = ezdxf.new(units=number)
    names, space = ["0", "cut"], document.modelspace()
    for name, hide in (("frozen", "freeze"), ("off", "off"), ("markers", None)):
        layer = document.layers.add(name)
        _ = hide and getattr(layer, hide)()
    target, depth = space, int(random.integers(4))
    for level in range(depth):
        block = document.blocks.new(f"block {level}")
        turn, scale = float(random.uniform(0, 360)), float(random.choice([0.5, 1, 2]))
        mirror = {
            "xscale": scale * random.choice([-1, 1]),
            "yscale": scale,
            "zscale": scale,
            "rotation": turn,
        }
        shift = tuple(random.uniform(-50, 50, 2) / length)
        target.add_blockref(block.name, shift, dxfattribs={**mirror, "layer": random.choice(names)})
        target, length = block, length * scale
    for curve in (sketch.outline, *sketch.cavities):
        _dxf_curve(random, target, curve, length, gap, str(random.choice(names)))
    for kind in ("frozen", "off", "invisible"):
        if random.random() < 0.5:
            seen = {"invisible": 1} if kind == "invisible" else {"layer": kind}
            block = document.blocks.new(f"frame {kind}")
            block.add_lwpolyline([(-9, -9), (500, -9), (500, 300)], close=True)
            target.add_blockref(block.name, (0, 0), dxfattribs=seen)
    if len(sketch.markers):
        _dxf_markers(random, document, target, sketch.markers, length)
    document.saveas(path)
    kind = f"unit {number}{', a lie' if lies else ''}, {depth} blocks, gap {gap}"
    head = random.random() < 0.2 and (lies or length == 1) and not depth
    if head and number in (0, 4):
        _without_header(path)
    return _drawn(path, kind, {}, gap * 2)


def _without_header(path: Path) -> None:
    text = path.read_text()
    start, end = text.index("  0\nSECTION\n  2\nHEADER"), text.index("  0\nENDSEC\n") + len("  0\nENDSEC\n")
    path.write_text(text[:start] + text[end:])


def _dxf_curve(
    random: np.random.Generator, target: Any, curve: "Curve", length: float, gap: float, layer: str
) -> None:
    points, on = curve.points / length, {"layer": layer}
    if random.random() < 0.5 and not gap:
        corners = np.concatenate([points, np.zeros((len(points), 2)), curve.bulges[:, None]], axis=1)
        target.add_lwpolyline(corners.tolist(), close=True, dxfattribs=on)
        return
    for which in random.permutation(len(points)).tolist():
        start, end, bulge = points[which], points[(which + 1) % len(points)], float(curve.bulges[which])
        if bulge:
            centre, first, last, radius = ezdxf.math.bulge_to_arc(tuple(start), tuple(end), bulge)
            target.add_arc(centre, radius, np.degrees(first), np.degrees(last), dxfattribs=on)
        else:
            start = start + gap / length * (end - start) / np.linalg.norm(end - start)
            ends = (end, start) if random.random() < 0.5 else (start, end)
            target.add_line(*ends, dxfattribs=on)


def _dxf_markers(
    random: np.random.Generator, document: Any, target: Any, markers: np.ndarray, length: float
) -> None:
    radius, on = 0.4 / length, {"layer": "markers"}
    block = document.blocks.new("dot")
    block.add_circle((0, 0), radius)
    way = int(random.integers(4))
    for x, y in markers / length:
        if way == 0:
            target.add_circle((x, y), radius, dxfattribs=on)
        elif way == 1:
            target.add_blockref("dot", (x, y), dxfattribs=on)
        elif way == 2:
            for first in (0, 180):
                target.add_arc((x, y), radius, first, first + 180, dxfattribs=on)
        else:
            target.add_point((x, y), dxfattribs=on)


def svg(random: np.random.Generator, sketch: "Sketch", path: Path) -> "Drawn":
    """An SVG file: some unit, transformed, also through copies, beside what is not drawn."""
    unit, length = [("mm", 1.0), ("cm", 10.0), ("in", 25.4), ("pt", 25.4 / 72), ("em", 1.0), ("", 25.4 / 96)][
        int(random.integers(6))
    ]
    scale = float(random.choice([0.5, 1, 3]))
    unit_of_group = scale * length
    curves = " ".join(_svg_path(curve, unit_of_group) for curve in (sketch.outline, *sketch.cavities))
    dots = "".join(
        f'<circle cx="{x:.12g}" cy="{y:.12g}" r="{0.4 / unit_of_group:.12g}"/>'
        for x, y in sketch.markers / unit_of_group
    )
    content = f'<g id="finger"><path d="{curves}"/><g id="markers">{dots}</g></g>'
    turn = f"rotate({random.uniform(0, 360):.9g}) scale({scale if random.random() < 0.5 else -scale} {scale})"
    way = int(random.integers(2))
    content = [
        f'<g transform="{turn}">{content}</g>',
        f'<mask>{content}</mask><g transform="{turn}"><use href="#finger" y="-7"/></g>',
    ][way]
    hidden = "".join(
        f"<{tag}><circle r='300'/></{tag}>"
        for tag in ("mask", "marker", "symbol", "clipPath", "pattern", "metadata")
        if random.random() < 0.3
    )
    size = f'width="400{unit}" height="300{unit}" ' if unit else ""
    head = f'xmlns="http://www.w3.org/2000/svg" {size}viewBox="-200 -100 400 300"'
    path.write_text(f"<svg {head}><path/>{hidden}{content}</svg>")
    return _drawn(path, f"unit {unit or 'none'}, way {way}", {})


def _svg_path(curve: "Curve", length: float) -> str:
    text = ""
    for which, (start, bulge) in enumerate(zip(curve.points / length, curve.bulges, strict=True)):
        end = curve.points[(which + 1) % len(curve.points)] / length
        text += "" if text else f"M{start[0]:.15g} {start[1]:.15g}"
        radius = np.linalg.norm(end - start) * (1 + bulge**2) / (4 * bulge) if bulge else 0.0
        text += f"A{radius:.15g} {radius:.15g} 0 0 1 " if bulge else "L"
        text += f"{end[0]:.15g} {end[1]:.15g}"
    return text + "Z"


def step(random: np.random.Generator, sketch: "Sketch", path: Path) -> "Drawn":
    """A STEP file: an assembly of assemblies, moved and turned, with split or chamfered faces."""
    import cadquery as cq

    loops = [_wire(curve) for curve in (sketch.outline, *sketch.cavities)]
    solid = cq.Solid.extrudeLinear(loops[0], loops[1:], cq.Vector(0, 0, 12))
    way = int(random.integers(4))
    wide = float(np.ptp(sketch.outline.points[:, 0]))
    if way == 1:  # split at its middle
        halves = [cq.Solid.makeBox(wide, 200, 40, pnt=cq.Vector(x, -50, -5)) for x in (-wide / 2, wide / 2)]
        solid = solid.intersect(halves[0]).fuse(solid.intersect(halves[1])).Solids()[0]
    elif way == 2:  # a second, smaller step on it
        solid = solid.fuse(
            cq.Solid.makeBox(2, 2, 5, pnt=cq.Vector(wide / 2, sketch.outline.points[:, 1].max() - 2, 12))
        )
    settings = {"plane": f"z = {random.choice([3, 12])}"} if way == 2 else {}
    place = cq.Location(*random.uniform(-50, 50, 2), 0, 0, 0, random.uniform(0, 360))
    whole, inner = cq.Assembly(name="whole"), cq.Assembly(name="inner")
    solid = solid if isinstance(solid, cq.Solid) else solid.Solids()[0]
    inner.add(solid.moved(place.inverse), name="body:1", loc=place)
    disc = cq.Solid.makeCylinder(0.4, 0.5)
    dots = cq.Assembly(name="dots")
    for number, (x, y) in enumerate(sketch.markers, start=1):
        dots.add(disc, name=f"marker-1:{number}", loc=cq.Location(x, y, 11.5 if way != 2 else 0))
    if len(sketch.markers):
        inner.add(dots, name="dots")
    turned = (0, *random.uniform(0, 360, 2)) if way != 2 else (0, 0, 0)
    shift = random.uniform(-20, 20, 3) if way != 2 else np.zeros(3)
    whole.add(inner, name="inner:1", loc=cq.Location(*shift, *turned))
    whole.export(str(path))
    return _drawn(path, f"way {way}", settings)


def _wire(curve: "Curve") -> Any:
    import cadquery as cq

    edges = []
    for which, (start, bulge) in enumerate(zip(curve.points, curve.bulges, strict=True)):
        end = curve.points[(which + 1) % len(curve.points)]
        chord = end - start
        middle = 0.5 * (start + end) + 0.5 * bulge * np.array([chord[1], -chord[0]])
        ends = [cq.Vector(*point) for point in (start, middle, end)]
        edges.append(cq.Edge.makeThreePointArc(*ends) if bulge else cq.Edge.makeLine(ends[0], ends[2]))
    return cq.Wire.assembleEdges(edges)


def msh(random: np.random.Generator, sketch: "Sketch", path: Path) -> "Drawn":
    """A mesh of some version, plane or extruded; corners at the ends of arcs are cut straight."""
    import gmsh

    from pinnray.geometry.mesh.mesher import session

    depth = float(random.choice([0, 12]))
    version = float(random.choice([1, 2.2, 4.1]))
    with session():
        loops = [_mesh_loop(curve) for curve in (sketch.outline, *sketch.cavities)]
        surface = gmsh.model.geo.addPlaneSurface(loops)
        if depth:
            gmsh.model.geo.extrude([(2, surface)], 0, 0, depth, numElements=[1])
        if far := random.random() < 0.5:
            gmsh.model.geo.addPoint(-70, 300, 50)
        gmsh.model.geo.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMax", 8)
        gmsh.option.setNumber("Mesh.SaveAll", 1)
        gmsh.model.mesh.generate(3 if depth else 2)
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.write(str(path))
    if mark := random.random() < 0.3:
        path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    return _drawn(path, f"version {version}, depth {depth:g}, point {far}, mark {mark}", {})


def _mesh_loop(curve: "Curve") -> int:
    import gmsh

    tags = [gmsh.model.geo.addPoint(x, y, 0) for x, y in curve.points]
    lines = [gmsh.model.geo.addLine(a, b) for a, b in zip(tags, tags[1:] + tags[:1], strict=True)]
    return int(gmsh.model.geo.addCurveLoop(lines))
