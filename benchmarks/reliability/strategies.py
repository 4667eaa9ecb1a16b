"""Random fingers, drawings and settings: good values, limits, and mistakes of people and programs."""

from math import inf, nan
from typing import Any, NamedTuple

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from pinnray.geometry.finger.parameters import Parameters, parameter_info
from pinnray.geometry.finger.presets import load_design, preset_names
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.solvers.registry import make_solver
from pinnray.studies.sweep.job import Task
from pinnray.studies.sweep.study import PHYSICS, parameter_limits

WILD: tuple[Any, ...] = (
    *(nan, inf, -inf, -1.0, 0, -0.0, 1e-300, 5e-324, 1e300, 2**63, 10**400, True, None, "", "2 mm", "nan"),
    *("1e999", [], [1.0], {}, {"from": 1}, (1, 2), b"2", "é\n\x00", 1j),
)
"""Values that belong to no parameter."""

WORDS = {
    "rib_reference": ("front", "base"),
    "marker_layout": ("front", "joints"),
    "plane": ("strain", "stress"),
    "law": ("linear", "neo-hookean", "st-venant-kirchhoff", "gent"),
    "load": ("mean", "point", "patch", "cylinder"),
    "slide": (True, False),
}
USUAL = {"young": 11.4, "poisson": 0.45, "stroke": 10.0, "radius": 5.0, "direction": 20.0}
NAMES = [name for name in Parameters.model_fields if name != "name"]

OUTLINES = (
    'rect width="{w}" height="{h}"',
    'rect width="{w}" height="{h}" rx="{r}"',
    'ellipse cx="0" cy="0" rx="{w}" ry="{h}"',
    'path d="M0 0H{w}V{r}L0 {h}Z"',
    'path d="M0 0Q{w} {r} {w} 0V{h}A99 99 0 0 1 0 {h}Z"',
    'polygon points="0,0 {w},{r} {r},{h} {x},{y}"',
)
CAVITIES = (
    'rect x="{x}" y="{y}" width="{r}" height="{r}"',
    'circle cx="{x}" cy="{y}" r="{r}"',
    'path d="M{x} {y}l{r} 0l0 {r}z"',
)
AROUND = (
    *('<g transform="rotate(30)">{}</g>', '<g transform="scale(0.5)">{}</g>'),
    *('<g transform="matrix(2 0 0 1 2 3)">{}</g>', '<g id="front">{}</g>', '<g id="é">{}</g>'),
)
LINES = (
    *("clamp = [[0, 0], [0, -{h}]]", "contact = [{x}, 0]", "contact = [{x}, 0]\ncontact_width = {r}"),
    *("markers = 5", "markers = [[{x}, -{y}]]", "marker_diameter = {r}", "depth = {h}", 'units = "cm"'),
    *("markers = 3", "contact = [0, 0]", 'contact = "é"'),
)
SPOILT = (
    *("clamp = nan", "contact = []", "markers = [[0, 0]]", "depth = -1", "depth = 1e999", 'units = ""'),
    *('plane = "\\u0000"', "clamp = true", "clamp = [[nan, 0], [0, 1]]", "x = {{}}", 'contact = "outline"'),
)
NUMBERS = ("nan", "inf", "1e999", "-1e308", "0", "-0", "1e-9", "1e9", "", "x", "5%", "1e")
"""Words that stand where a number belongs."""


class Sketch(NamedTuple):
    """A drawing: text of the SVG file, and lines that describe it, such as `contact = [35, 0]`."""

    svg: str
    lines: tuple[str, ...]


class Given(NamedTuple):
    """A task of a sweep, whose finger is the one of a sketch if there is one."""

    task: Task
    sketch: Sketch | None


@st.composite
def sketches(draw: st.DrawFn) -> Sketch:
    """An outline with up to three cavities; a third of them with a word where a number belongs."""
    wide, high = draw(st.floats(30, 150)), draw(st.floats(4, 40))
    ranges = {"x": (0.2 * wide, 0.9 * wide), "y": (0.2 * high, 0.6 * high), "r": (0.01 * high, 0.4 * high)}

    def filled(template: str) -> str:
        sizes = {name: f"{draw(st.floats(*ends)):.3f}" for name, ends in ranges.items()}
        return template.format(w=f"{wide:.3f}", h=f"{high:.3f}", **sizes)

    parts = [filled(draw(st.sampled_from(OUTLINES)))]
    parts += [filled(each) for each in draw(st.lists(st.sampled_from(CAVITIES), max_size=3))]
    wild = draw(st.sampled_from((False, False, True)))
    lines = draw(st.lists(st.sampled_from(LINES), max_size=3, unique=True))
    if wild:
        parts += [draw(st.sampled_from(parts))] * draw(st.booleans())  # drawn twice
        lines.append(draw(st.sampled_from(SPOILT)))
    body = "".join(f"<{part}/>" for part in parts)
    if draw(st.integers(0, 3)) == 0:
        body = draw(st.sampled_from(AROUND)).format(body)
    if wild:
        body = _spoilt(draw, body)
    head = f'width="{wide:.3f}mm" height="{high:.3f}mm" viewBox="0 0 {wide:.3f} {high:.3f}"'
    if draw(st.integers(0, 5)) == 0:
        head = draw(st.sampled_from(["", 'width="10cm"', 'width="4in" viewBox="0 0 100 100"', 'width="0"']))
    return Sketch(f'<svg xmlns="http://www.w3.org/2000/svg" {head}>{body}</svg>', tuple(map(filled, lines)))


def _spoilt(draw: st.DrawFn, body: str) -> str:
    """The drawing with one of its numbers replaced by a word, or cut off."""
    if draw(st.integers(0, 4)) == 0:
        return body[: draw(st.integers(0, len(body)))]
    words = body.split('"')
    words[2 * draw(st.integers(0, (len(words) - 2) // 2)) + 1] = draw(st.sampled_from(NUMBERS))
    return '"'.join(words)


def value_of(name: str) -> SearchStrategy[Any]:
    """Values of a parameter within its limits, at them, or near its usual ones."""
    if name in WORDS:
        return st.sampled_from(WORDS[name])
    field = Parameters.model_fields.get(name)
    low, high = {"stroke": (1e-6, 1e3), "radius": (1e-3, 1e3)}.get(name) or (
        (float(parameter_info(name, "low")), float(parameter_info(name, "high")))
        if field
        else parameter_limits(name)
    )
    if field and field.annotation is int:
        return st.integers(int(low), int(high)) | st.integers(int(low), min(int(high), 10))
    number = st.floats(low, high) | st.sampled_from((low, high))
    if usual := field.default if field else USUAL.get(name):
        number |= st.floats(0.3, 3).map(lambda factor: min(max(usual * factor, low), high))
    return number


@st.composite
def inputs(draw: st.DrawFn, solver: str = "fem") -> Given:
    """A finger, by its parameters or as a drawing, its material, its load and the solver's settings.

    Half of them are gentle, so that most have a result; of the others one in two has a wild value.
    """
    gentle = draw(st.booleans())
    sketch = draw(sketches()) if draw(st.integers(0, 3)) == 0 else None
    definition = {} if sketch else _definition(draw, gentle)
    chosen = draw(st.lists(st.sampled_from(PHYSICS), max_size=3, unique=True))
    physics = {name: draw(value_of(name)) for name in chosen}
    settings = {} if gentle else _settings(draw, solver)
    if not gentle and draw(st.booleans()):
        name = draw(st.sampled_from([*(NAMES if definition else ()), *PHYSICS]))
        (physics if name in PHYSICS else definition)[name] = draw(st.sampled_from(WILD))
    mesh, density = MeshSettings(size=draw(st.sampled_from((2.0, 4.0, 8.0, 20.0)))), draw(st.floats(1e-3, 30))
    return Given(Task(0, definition, mesh, physics, solver, settings, density), sketch)


def _definition(draw: st.DrawFn, gentle: bool) -> dict[str, Any]:
    """A preset with up to four parameters changed."""
    definition = dict(load_design(draw(st.sampled_from(preset_names()))).definition())
    for name in draw(st.lists(st.sampled_from(NAMES), max_size=4, unique=True)):
        now = definition[name]
        changes = st.floats(0.8, 1.25).map(lambda factor, now=now: now * factor)
        definition[name] = draw(changes if gentle and isinstance(now, float) else value_of(name))
    return definition


def _settings(draw: st.DrawFn, solver: str) -> dict[str, Any]:
    """Up to two settings of a solver: other ones of the same type, near its own, or wild ones."""
    usual = make_solver(solver).settings()
    found = {}
    for name in draw(st.lists(st.sampled_from(sorted(usual)), max_size=2, unique=True)):
        now = usual[name]
        near: SearchStrategy[Any] = st.just(now)
        if isinstance(now, bool):
            near = st.booleans()
        elif isinstance(now, int):
            near = st.integers(-1, 5)
        elif isinstance(now, float):
            near = st.floats(0.1, 10).map(lambda factor, now=now: now * factor)
        found[name] = draw(near | near | near | st.sampled_from(WILD))
    return found
