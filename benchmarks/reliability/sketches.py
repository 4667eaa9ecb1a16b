"""Random drawings of a section as SVG with lines of a description: sound, near misses and absurd."""

from typing import NamedTuple

from hypothesis import strategies as st

NUMBERS = st.sampled_from(["nan", "inf", "1e999", "-1e308", "0", "-0", "1e-9", "1e9", "", "x", "5%", "1e"])
"""Words that stand where a number belongs."""

LABELS = ("outline", "base", "clamp", "front", "contact", "markers", "é", "a b")
TRANSFORMS = (
    "rotate({:.0f})",
    "scale({:.3g})",
    "translate({:.3g})",
    "skewX({:.0f})",
    "matrix({:.3g} 0 0 1 2 3)",
)


class Sketch(NamedTuple):
    """A drawing: text of the SVG file, and lines that describe it, such as `contact = [35, 0]`."""

    svg: str
    lines: tuple[str, ...]


@st.composite
def sketches(draw: st.DrawFn) -> Sketch:
    """An outline with up to three cavities; a third of them with a word where a number belongs."""
    wide, high = draw(st.floats(30, 150)), draw(st.floats(4, 40))
    wild = draw(st.integers(0, 2)) == 0
    parts = [_outline(draw, wide, high), *_cavities(draw, wide, high)]
    parts += [draw(st.sampled_from(parts))] * (wild and draw(st.booleans()))  # drawn twice
    body = "".join(f"<{part}/>" for part in parts)
    if wild:
        body = _spoilt(draw, body)
    if draw(st.integers(0, 5)) == 0:
        body = f'<g id="{draw(st.sampled_from(LABELS))}">{body}</g>'
    if draw(st.integers(0, 3)) == 0:
        transform = draw(st.sampled_from(TRANSFORMS)).format(draw(st.floats(-90, 90) | st.floats(0.5, 2)))
        body = f'<g transform="{transform}">{body}</g>'
    head = f'width="{wide:.3f}mm" height="{high:.3f}mm" viewBox="0 0 {wide:.3f} {high:.3f}"'
    if draw(st.integers(0, 5)) == 0:
        head = draw(st.sampled_from(["", 'width="10cm"', 'width="4in" viewBox="0 0 100 100"', 'width="0"']))
    return Sketch(
        f'<svg xmlns="http://www.w3.org/2000/svg" {head}>{body}</svg>',
        tuple(_lines(draw, wide, high, wild)),
    )


def _outline(draw: st.DrawFn, wide: float, high: float) -> str:
    kind = draw(st.sampled_from(["beam", "ray", "rounded", "ellipse", "curved", "polygon"]))
    if kind == "beam":
        return f'rect width="{wide:.3f}" height="{high:.3f}"'
    if kind == "rounded":
        return f'rect width="{wide:.3f}" height="{high:.3f}" rx="{draw(st.floats(0, high)):.3f}"'
    if kind == "ellipse":
        return f'ellipse cx="{wide / 2:.3f}" cy="{high / 2:.3f}" rx="{wide / 2:.3f}" ry="{high / 2:.3f}"'
    if kind == "ray":
        return f'path d="M0 0H{wide:.3f}V{high / 6:.3f}L0 {high:.3f}Z"'
    if kind == "curved":
        bend = draw(st.floats(-1, 1)) * high
        return f'path d="M0 0Q{wide / 2:.3f} {bend:.3f} {wide:.3f} 0V{high:.3f}A99 99 0 0 1 0 {high:.3f}Z"'
    corners = draw(st.lists(st.tuples(st.floats(0, wide), st.floats(0, high)), min_size=1, max_size=8))
    return f'polygon points="{" ".join(f"{x:.2f},{y:.2f}" for x, y in corners)}"'


def _cavities(draw: st.DrawFn, wide: float, high: float) -> list[str]:
    found = []
    for _ in range(draw(st.integers(0, 3))):
        x, y = draw(st.floats(0.1, 0.8)) * wide, draw(st.floats(0.2, 0.6)) * high
        size = draw(st.floats(0.01, 0.4)) * high
        shapes = (
            f'rect x="{x:.3f}" y="{y:.3f}" width="{2 * size:.3f}" height="{size:.3f}"',
            f'circle cx="{x:.3f}" cy="{y:.3f}" r="{size / 2:.3f}"',
            f'path d="M{x:.3f} {y:.3f}l{size:.3f} 0l0 {size:.3f}z"',
        )
        found.append(draw(st.sampled_from(shapes)))
    return found


def _spoilt(draw: st.DrawFn, body: str) -> str:
    """The drawing with one of its numbers replaced by a word, or cut off, or emptied."""
    end = draw(st.integers(0, 5))
    if end == 0:
        return body[: draw(st.integers(0, len(body)))]
    if end == 1:
        return ""
    words = body.split('"')
    which = 2 * draw(st.integers(0, (len(words) - 2) // 2)) + 1
    words[which] = draw(NUMBERS)
    return '"'.join(words)


def _lines(draw: st.DrawFn, wide: float, high: float, wild: bool) -> list[str]:
    """Lines of a description; with y upward, as in the drawing that is read."""
    x = draw(st.floats(0.2, 0.9)) * wide
    sound = (
        f"clamp = [[0, 0], [0, {-high:.3f}]]",
        f"contact = [{x:.3f}, 0]",
        f"contact = [{x:.3f}, 0]\ncontact_width = {draw(st.floats(0.1, 9)):.3f}",
        f"markers = {draw(st.integers(1, 12))}",
        f"markers = [[{x:.3f}, {-high / 12:.3f}]]",
        f"marker_diameter = {draw(st.floats(0.1, 3)):.3f}",
        f"depth = {draw(st.floats(1, 50)):.3f}",
        f'units = "{draw(st.sampled_from(["um", "mm", "cm", "m", "in"]))}"',
        f'clamp = "{draw(st.sampled_from(LABELS))}"',
        f'contact = "{draw(st.sampled_from(LABELS))}"',
    )
    found = draw(st.lists(st.sampled_from(sound), max_size=3, unique=True))
    if wild:
        name = draw(st.sampled_from(["clamp", "contact", "markers", "depth", "units", "plane", "name", "x"]))
        values = (
            "nan",
            "[]",
            "[[0, 0]]",
            "-1",
            "1e999",
            '""',
            '"\\u0000"',
            "true",
            "[[nan, 0], [0, 1]]",
            "{}",
        )
        found.append(f"{name} = {draw(st.sampled_from(values))}")
    return found
