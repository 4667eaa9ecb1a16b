"""Random fingers, settings, materials and loads: each a valid result or one line, in bounded time.

`python -m benchmarks.reliability.inputs COUNT [SOLVER]` counts the ends; needs Hypothesis.
"""

import math
import sys
import time
from collections import Counter
from math import inf, nan
from typing import Any

from hypothesis import Phase, given, seed, settings
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from pinnray.geometry.finger.parameters import Parameters, parameter_info
from pinnray.geometry.finger.presets import load_design, preset_names
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.runtime.errors import UserError
from pinnray.solvers.finger_figures import QUANTITIES
from pinnray.solvers.registry import make_solver
from pinnray.studies.sweep.job import Task
from pinnray.studies.sweep.measurement import Measurement, measured
from pinnray.studies.sweep.study import PHYSICS, parameter_limits

LONGEST_S = 60.0
"""Time that a coarse finger may take, s."""

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
def tasks(draw: DrawFn, solver: str = "fem") -> Task:
    """A finger, its material, its load and the solver's settings.

    Half of them are gentle, so that most have a result; of the others one in two has a wild value.
    """
    gentle = draw(st.booleans())
    definition = dict(load_design(draw(st.sampled_from(preset_names()))).definition())
    for name in draw(st.lists(st.sampled_from(NAMES), max_size=4, unique=True)):
        near = gentle and isinstance(definition[name], float)
        definition[name] = draw(_near(definition[name], 0.8) if near else value_of(name))
    chosen = draw(st.lists(st.sampled_from(PHYSICS), max_size=3, unique=True))
    physics = {name: draw(value_of(name)) for name in chosen}
    own = {}
    if not gentle:
        usual = make_solver(solver).settings()
        for name in draw(st.lists(st.sampled_from(sorted(usual)), max_size=2, unique=True)):
            own[name] = draw(_near(usual[name], 0.1) | _near(usual[name], 0.1) | st.sampled_from(WILD))
        if draw(st.booleans()):
            name = draw(st.sampled_from([*NAMES, *PHYSICS]))
            (physics if name in PHYSICS else definition)[name] = draw(st.sampled_from(WILD))
    mesh, density = MeshSettings(size=draw(st.sampled_from((2.0, 4.0, 8.0, 20.0)))), draw(st.floats(1e-3, 30))
    return Task(0, definition, mesh, physics, solver, own, density)


def _near(now: Any, least: float) -> SearchStrategy[Any]:
    """Values of the type of another one: a number times a factor from `least` on."""
    if isinstance(now, bool):
        return st.booleans()
    if isinstance(now, int):
        return st.integers(-1, 5)
    if isinstance(now, float):
        return st.floats(least, 1 / least).map(lambda factor: now * factor)
    return st.just(now)


def answer_to(task: Task) -> Measurement:
    """The end of a task."""
    try:
        return measured(task)
    except UserError as error:
        return Measurement(0, "refused", str(error), 0.0)
    except Exception as error:
        return Measurement(0, "failed", f"{type(error).__name__}: {error}", 0.0)


def fault_of(answer: Measurement, seconds: float) -> str:
    """The broken promise in the end of an input; empty if there is none."""
    # Some quantities are not of every finger; of a section without cavities these are infinite.
    free = {name for name, quantity in QUANTITIES.items() if not quantity.always}
    free |= {name for name in ("thinnest_wall", "narrowest_gap") if answer.values.get(name) == math.inf}
    bad = [name for name, value in answer.values.items() if not math.isfinite(value) and name not in free]
    faults = {
        f"an error of the program: {answer.message}": answer.state == "failed",
        "no word of explanation": not answer.message.strip(),
        f"a message for programmers: {answer.message}": answer.state == "refused"
        and "Error:" in answer.message,
        f"not finite: {', '.join(bad)}, though it is {answer.state}": bool(bad),
        f"it took more than {LONGEST_S:.0f} s": seconds > LONGEST_S,
    }
    return next((said for said, wrong in faults.items() if wrong), "")


def tried(count: int, solver: str = "fem") -> tuple[Counter[str], dict[str, Task]]:
    """Numbers of random tasks by their ends, and the first one of every fault."""
    states, wrong = Counter[str](), dict[str, Task]()

    @seed(0)
    @settings(max_examples=count, database=None, deadline=None, phases=[Phase.generate])
    @given(tasks(solver))
    def one(task: Task) -> None:
        started = time.perf_counter()
        answer = answer_to(task)
        states[answer.state] += 1
        if (fault := fault_of(answer, time.perf_counter() - started)) and fault not in wrong:
            wrong[fault] = task
            print(fault, task, sep="\n  ", flush=True)

    one()
    return states, wrong


if __name__ == "__main__":
    print(tried(int(sys.argv[1]), *sys.argv[2:])[0])
