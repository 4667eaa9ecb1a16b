"""Random values of every setting: good ones, their limits, and what people and broken programs give."""

from math import inf, nan
from typing import Any, NamedTuple

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from benchmarks.reliability.sketches import Sketch, sketches
from compare.sweep.study import LOAD, MATERIAL, PHYSICS, Task, parameter_limits
from geometry.finger.parameters import Parameters, parameter_info
from geometry.finger.presets import load_design, preset_names
from solvers.registry import make_solver

SIZES = (2.0, 4.0, 8.0, 20.0)
"""Element sizes, mm."""

WILD: tuple[Any, ...] = (
    *(
        nan,
        inf,
        -inf,
        -1.0,
        0,
        -0.0,
        1e-300,
        5e-324,
        1e300,
        2**63,
        10**400,
        True,
        None,
        "",
        "2 mm",
        "nan",
        "1e999",
    ),
    *([], [1.0], {}, {"from": 1}, (1, 2), b"2", "é\n\x00", 1j),
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


def value_of(name: str) -> SearchStrategy[Any]:
    """Values of a parameter within its limits, at them, or near its usual ones."""
    if name in WORDS:
        return st.sampled_from(WORDS[name])
    low, high = _limits(name)
    if name in Parameters.model_fields and Parameters.model_fields[name].annotation is int:
        return st.integers(int(low), int(high)) | st.integers(int(low), min(int(high), 10))
    usual = Parameters.model_fields[name].default if name in Parameters.model_fields else USUAL.get(name)
    number = st.floats(low, high)
    if usual:
        number |= st.floats(0.3, 3).map(lambda factor: min(max(usual * factor, low), high))
    return number | st.sampled_from((low, high))


USUAL = {"young": 11.4, "poisson": 0.45, "stroke": 10.0, "radius": 5.0, "direction": 20.0}


def _limits(name: str) -> tuple[float, float]:
    if name in Parameters.model_fields:
        return float(parameter_info(name, "low")), float(parameter_info(name, "high"))
    return {"stroke": (1e-6, 1e3), "radius": (1e-3, 1e3)}.get(name, parameter_limits(name))


NAMES = [name for name in Parameters.model_fields if name not in ("name",)]


class Given(NamedTuple):
    """What a command is given: a task, whose finger is that of a sketch if there is one."""

    task: Task
    sketch: Sketch | None


@st.composite
def inputs(draw: st.DrawFn, solver: str = "fem") -> Given:
    """A finger, by its parameters or as a drawing, its material, its load and the solver's settings.

    Half of them are gentle, so that most have a result; of the others one in two has a wild value.
    """
    gentle = draw(st.booleans())
    sketch = draw(sketches()) if draw(st.integers(0, 3)) == 0 else None
    definition = {} if sketch else draw(_definitions(gentle))
    physics = {
        name: draw(value_of(name))
        for name in draw(st.lists(st.sampled_from(PHYSICS), max_size=3, unique=True))
    }
    settings = draw(_settings(solver)) if not gentle else {}
    if not gentle and draw(st.booleans()):
        name = draw(st.sampled_from([*(NAMES if definition else ()), *PHYSICS]))
        (physics if name in PHYSICS else definition)[name] = draw(st.sampled_from(WILD))
    task = Task(
        0,
        definition,
        draw(st.sampled_from(SIZES)),
        {name: physics[name] for name in MATERIAL if name in physics},
        {"kind" if name == "load" else name: physics[name] for name in LOAD if name in physics},
        solver,
        settings,
        draw(st.floats(1e-3, 30)),
    )
    return Given(task, sketch)


@st.composite
def _definitions(draw: st.DrawFn, gentle: bool) -> dict[str, Any]:
    """A preset with up to four parameters changed."""
    definition = dict(load_design(draw(st.sampled_from(preset_names()))).definition())
    for name in draw(st.lists(st.sampled_from(NAMES), max_size=4, unique=True)):
        now = definition[name]
        changes = st.floats(0.8, 1.25).map(lambda factor, now=now: now * factor)
        definition[name] = draw(changes if gentle and isinstance(now, float) else value_of(name))
    return definition


@st.composite
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
