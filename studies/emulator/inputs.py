"""From a finger of a study to the numbers that an emulator works with."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pinnray.geometry.finger.parameters import SYMBOLS, Parameters
from pinnray.geometry.finger.rules import broken_rule
from pinnray.geometry.finger.section import cavity_ends, rib_feet, rib_pitch
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.finger_figures import QUANTITIES
from pinnray.solvers.problem import Load, Material
from pinnray.studies.emulator.frame import BeamFrame
from pinnray.studies.sweep.job import LEAST_MARKERS
from pinnray.studies.sweep.study import PHYSICS, WHOLE, Range, Study, Value, physics_of, unit_of

STILL = ("contact_position", "depth")
"""Parameters of a design that do not change its section."""

WIDE = 1.8
"""Ratio of a range's ends from which the logarithm of the parameter is taken."""

STRESS_SCALE = 0.3
"""Change of a stress's logarithm that counts as much as a parameter's standard deviation."""

LEAST_STRESS = 1e-9
"""Least stress of a frame over Young's modulus, for fingers without ribs."""


@dataclass(frozen=True, eq=False)
class Features:
    """The numbers of n fingers.

    Attributes:
        inputs: Of the processes, shape (n, d).
        bases: What the frames say of quantities, by name, in the quantities' units, shape (n,) each.
        units: Unit of the difference from the base of quantities that can be negative, shape (n,) each.
    """

    inputs: FloatArray
    bases: dict[str, FloatArray]
    units: dict[str, FloatArray]


class Inputs:
    """Makes the numbers of a study's fingers.

    Args:
        study: The study.
        base: Parameters of the finger that the study does not vary.

    Raises:
        UserError: If the study is of a drawing.
    """

    def __init__(self, study: Study, base: Mapping[str, Any]) -> None:
        if "section" in base:
            raise UserError(
                f"the sweep {study.name} is of a drawing, and an emulator needs the parameters of a design; "
                "sweep a design, or solve the drawing itself"
            )
        self.study = study
        own = {name: value for name, value in base.items() if name in Parameters.model_fields}
        self.base = own | {name: least for name, least in LEAST_MARKERS.items() if name not in study.varied}

    def read(self, settings: Mapping[str, str]) -> dict[str, Value]:
        """A finger from texts; see `fault`."""
        named = [(SYMBOLS.get(name, name), text) for name, text in settings.items()]
        return {
            name: _read(name, self.study.varied[name], text) if name in self.study.varied else text
            for name, text in named
        }

    def finger(self, settings: Mapping[str, str], where: str = "") -> dict[str, Value]:
        """A finger from texts that can be predicted.

        Raises:
            UserError: If it cannot; the message begins with `where`.
        """
        finger = self.read(settings)
        if fault := self.fault(finger):
            raise UserError(f"{where}{fault}")
        return finger

    def fault(self, finger: Mapping[str, Value]) -> str | None:
        """The reason why a finger cannot be predicted, or None."""
        varied = self.study.varied
        if unknown := [name for name in finger if name not in varied]:
            return f"{unknown[0]} is not varied in this sweep, which varies {', '.join(varied)}"
        if missing := [name for name in varied if name not in finger]:
            return f"{missing[0]} is missing; give {_in_words(missing[0], varied[missing[0]])}"
        for name, values in varied.items():
            if not _contains(name, values, finger[name]):
                return f"{name} = {_text(finger[name])} is outside the sweep: {_in_words(name, values)}"
        return broken_rule(self.parameters(finger))

    def parameters(self, finger: Mapping[str, Value]) -> Parameters:
        """The parameters of a finger's shape."""
        shape = {name: value for name, value in finger.items() if name not in PHYSICS}
        return Parameters(**{**self.base, **shape, "name": "predicted"})

    def physics(self, finger: Mapping[str, Value]) -> tuple[Material, Load]:
        """Material and load of a finger."""
        return physics_of({**self.study.fixed, **finger})

    def numbers(self, fingers: Sequence[Mapping[str, Value]], shapes: Sequence[Parameters]) -> Features:
        """The numbers of fingers and their parameters."""
        columns = self.columns(fingers)
        phase = 2 * np.pi * np.array([_rib_phase(shape) for shape in shapes])
        answers, scales = self._frames(fingers, shapes)
        stress = np.log(np.maximum(answers[:, 6:9], LEAST_STRESS)) / STRESS_SCALE
        modulus, depth = scales.T
        force = answers[:, 0] * modulus * depth
        largest = np.maximum(answers[:, 6:9].max(axis=1), LEAST_STRESS)
        one = np.ones(len(fingers))
        bases = {
            **dict.fromkeys(QUANTITIES, one),  # of which the frames say nothing
            **{"force": force, "force_25": force / 4, "force_50": force / 2, "force_75": 0.75 * force},
            "tangential_force": np.zeros(len(fingers)),
            **{"tip_u": answers[:, 3], "tip_v": answers[:, 4], "wrap": answers[:, 5]},
            "compliance_along": answers[:, 1] / (modulus * depth),
            "compliance_across": answers[:, 2] / (modulus * depth),
            **{"von_mises": modulus * largest, "principal_strain": largest},
        }
        forces = dict.fromkeys((name for name in bases if "force" in name), modulus * depth)
        return Features(
            np.concatenate([columns, np.stack([np.cos(phase), np.sin(phase)], axis=1), stress], axis=1),
            bases,
            {**dict.fromkeys(bases, one), **forces},
        )

    @property
    def moves(self) -> bool:
        """Whether the section of the fingers varies."""
        return any(name in Parameters.model_fields and name not in STILL for name in self.study.varied)

    def columns(self, fingers: Sequence[Mapping[str, Value]]) -> FloatArray:
        """The varied parameters that are no mere factors, each with a standard deviation of about one."""
        factors = {"young"} if self.study.solver == "fem-3d" else {"young", "depth"}
        names = [name for name in self.study.varied if name not in factors]
        columns = [self._column(name, [finger[name] for finger in fingers]) for name in names]
        return np.concatenate([np.zeros((len(fingers), 0)), *columns], axis=1)

    def _column(self, name: str, values: Sequence[Value]) -> FloatArray:
        """Inputs of a parameter, with a standard deviation of about one, shape (n, 1) or (n, choices)."""
        chosen = self.study.varied[name]
        if chosen.values is not None and not all(type(each) in (int, float) for each in chosen.values):
            places = np.array([chosen.values.index(value) for value in values])
            return np.asarray(2.0 * np.eye(len(chosen.values))[places])
        low, high = chosen.ends
        numbers = np.array(values, dtype=np.float64)
        if low > 0 and high / low >= WIDE:
            low, high, numbers = np.log(low), np.log(high), np.log(numbers)
        return np.asarray(np.sqrt(12) * ((numbers - low) / ((high - low) or 1.0) - 0.5))[:, None]

    def _frames(
        self, fingers: Sequence[Mapping[str, Value]], shapes: Sequence[Parameters]
    ) -> tuple[FloatArray, FloatArray]:
        """Answers of the frames, shape (n, 9), and Young's modulus and depth, shape (n, 2).

        The answers are force, two compliances, tip displacement (2), wrap angle and three stresses.
        """
        physics = [self.physics(finger) for finger in fingers]
        groups: dict[tuple[Any, ...], list[int]] = {}
        for place, (shape, (material, load)) in enumerate(zip(shapes, physics, strict=True)):
            travel = (None, load.displacement[1]) if load.kind == "cylinder" else load.displacement
            key = (shape.rib_count, material.poisson, material.plane, travel)
            groups.setdefault(key, []).append(place)
        answers = np.zeros((len(shapes), 9))
        for (*_, travel), places in groups.items():
            own = [shapes[place] for place in places]
            found = BeamFrame.of(own).response(physics[places[0]][0], travel)
            wrap = _wrap(own, found.contact, found.tip)
            answers[places] = np.column_stack([found.force, found.compliance, found.tip, wrap, found.stress])
        scales = [(material.young, shape.depth) for shape, (material, _) in zip(shapes, physics, strict=True)]
        return answers, np.array(scales).reshape(-1, 2)


def _wrap(shapes: Sequence[Parameters], contact: FloatArray, tip: FloatArray) -> FloatArray:
    """The wrap angle of fingers whose contact and apex move, shape (n,), degrees."""
    middle = np.array([[shape.contact_abscissa, 0.0] for shape in shapes]) + contact
    apex = np.array([[shape.height, 0.0] for shape in shapes]) + tip
    rear, ahead = np.arctan2(middle[:, 1], middle[:, 0]), np.arctan2(*(apex - middle).T[::-1])
    return np.asarray(np.degrees(ahead - rear))


def _rib_phase(p: Parameters) -> float:
    """Place of the contact between the ribs, in pitches; a whole number at a rib."""
    first = rib_feet(p)[0] if p.rib_count else cavity_ends(p)[0]
    return float((p.contact_abscissa - first) / rib_pitch(p))


def _contains(name: str, values: Range, value: Value) -> bool:
    """Whether the sweep had the value within its range or among its choices."""
    if values.values is not None:
        return value in values.values
    if isinstance(value, bool | str):
        return False
    low, high = values.ends
    return low <= value <= high and (name not in WHOLE or float(value).is_integer())


def _read(name: str, values: Range, text: str) -> Value:
    """The choice or number that a text stands for; a text that is neither stays, for `fault` to tell."""
    choices, text = values.values or (), text.strip()
    try:
        number = float(text)
    except ValueError:
        return next((each for each in choices if _text(each).lower() == text.lower()), text)
    whole = name in WHOLE and number.is_integer()
    return next((each for each in choices if each == number), int(number) if whole else number)


def _in_words(name: str, values: Range) -> str:
    if values.values is not None:
        return f"one of {', '.join(map(_text, values.values))}"
    low, high = values.ends
    kind = "a whole number from " if name in WHOLE else ""
    return f"{kind}{low:g} to {high:g} {unit_of(name)}".rstrip()


def _text(value: Value) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return value if isinstance(value, str) else f"{value:g}"
