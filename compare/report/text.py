"""Words and numbers of the report."""

from collections.abc import Mapping, Sequence

import numpy as np
from markupsafe import Markup

from compare.evaluation.evaluation import Evaluation
from compare.runtime.tables import distance, number, percent
from geometry.arrays import FloatArray
from geometry.finger.finger import Finger
from geometry.observations import Observations
from solvers.problem import Load, Material

FINITE_STRAIN = "finite strain: the strain is Green-Lagrange, the stress Cauchy"
LAWS = {
    "linear": "linear elastic (Hooke), infinitesimal strain",
    "neo-hookean": f"neo-Hookean, {FINITE_STRAIN}",
    "st-venant-kirchhoff": f"St Venant-Kirchhoff, {FINITE_STRAIN}",
    "gent": f"Gent, {FINITE_STRAIN}",
}


def material_rows(material: Material, laws: Mapping[str, str]) -> list[tuple[str, str]]:
    """The material in words, and the solvers of each law where they differ."""
    constants = f"plane {material.plane}; E = {material.young:g} MPa, Poisson’s ratio {material.poisson:g}"
    if len(set(laws.values())) == 1:
        return [("Material", f"{LAWS[next(iter(laws.values()))]}; {constants}")]
    having = {law: [solver for solver in laws if laws[solver] == law] for law in laws.values()}
    rows = [(f"Law of {', '.join(solvers)}", LAWS[law]) for law, solvers in having.items()]
    return [("Material", constants), *rows]


PRESETS = {
    "fast": "network with random hidden weights, output layer solved exactly (preset fast)",
    "paper": "the paper’s training (preset paper)",
    "trained": "the paper’s networks, all weights trained by Gauss-Newton steps (preset trained)",
}


def preset_meanings(settings: Mapping[str, Mapping[str, object]]) -> dict[str, str]:
    """The kind of training of each solver whose preset says it, from all solvers' settings."""
    chosen = {name: str(own.get("preset", "")) for name, own in settings.items()}
    return {name: PRESETS[preset] for name, preset in chosen.items() if preset in PRESETS}


def load_sentence(load: Load, design: Finger) -> str:
    """Sentence on the load."""
    width = f"{design.contact_width:g} mm wide contact"
    where = {
        "mean": f"The weighted mean displacement of the {width} is prescribed",
        "point": "The displacement of one point, the contact’s middle, is prescribed",
        "patch": f"Every point of the {width} has the prescribed displacement",
        "cylinder": f"A rigid cylinder of radius {load.radius or 0:g} mm presses without friction where it "
        "touches the front, and moves by the prescribed displacement",
    }[load.kind]
    parts = [
        f"{name} is free"
        if value is None
        else f"{name} = {value:g} mm".replace("-", "−").replace(" ", "\N{NO-BREAK SPACE}")
        for name, value in zip("uv", load.displacement, strict=True)
    ]
    moved = ", ".join(parts).replace(" ", "\N{NO-BREAK SPACE}").replace(",\N{NO-BREAK SPACE}", ", ")
    middle = design.contact_abscissa if load.position is None else load.position
    about = f"{'from' if load.kind == 'cylinder' else 'about'} x = {middle:g} mm on the front"
    return f"{where}: {moved}, {about} (load “{load.kind}”)."


def headline(design: Finger) -> list[tuple[str, str]]:
    """The finger in a line: symbols of the paper with values, or else values alone."""
    if paper := [(symbol, value) for _, symbol, value in design.facts() if symbol]:
        return paper
    (width, height), count = np.ptp(design.section.bounds, axis=0), len(design.section.cavities)
    cavities = "no cavity" if count == 0 else "1 cavity" if count == 1 else f"{count} cavities"
    return [("", f"{width:.4g} mm by {height:.4g} mm"), ("", f"depth {design.depth:.4g} mm"), ("", cavities)]


def support_sentence(design: Finger) -> str:
    """Sentence on the clamped base."""
    pieces = list(design.section.named("base"))
    length = sum(float(loop.lengths[which]) for loop, which in pieces)
    parts = "" if len(pieces) == 1 else f" in {len(pieces)} pieces"
    return f"The base is clamped ({length:.4g} mm{parts}); all else is free of traction."


def source_sentence(observations: Observations) -> str:
    """Provenance of the marker displacements, opened by `Simulated`, `Measured` or `Unknown`."""
    return sentence(observations.origin)


def grouped(provenance: Mapping[str, object]) -> list[tuple[str, list[tuple[str, str]]]]:
    """Provenance as groups of lines; what is not in a mapping comes first, in a group without a title."""
    groups = {"": {key: value for key, value in provenance.items() if not isinstance(value, Mapping)}}
    groups |= {key: dict(value) for key, value in provenance.items() if isinstance(value, Mapping)}
    return [
        (
            title.replace("_", " "),
            [(str(key).replace("_", " "), in_words(value)) for key, value in lines.items()],
        )
        for title, lines in groups.items()
        if lines
    ]


def in_words(value: object) -> str:
    """A value of any kind; a mapping as `name value` pairs."""
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {in_words(inner)}" for key, inner in value.items()) or "defaults"
    return "–" if value is None else str(value)


def symbol(name: str) -> Markup:
    """A symbol of the paper, such as `L_tip`, with its index set as one."""
    letter, _, index = name.partition("_")
    return (
        Markup("<i>{}</i><sub>{}</sub>").format(letter, index)
        if index
        else Markup("<i>{}</i>").format(letter)
    )


def stat(name: str, value: object) -> str:
    """A number of a solver's record: whole numbers in full, others with four digits; a probability in %."""
    if not isinstance(value, float):
        return str(value)
    return percent(value, 4) if name.startswith("probability") else number(value)


ASPECTS = ("", "_deviation", "_low", "_high", "_resolution")
"""Endings of the numbers of a quantity that a solver has found with an interval."""


def record(stats: Mapping[str, object]) -> tuple[list[tuple[str, list[str]]], list[tuple[str, str]]]:
    """The numbers that a solver recorded of its solve, but for its time.

    Returns:
        The quantities that it found with an interval, each with its `ASPECTS`, and the rest by name.
    """
    names = [name for name in stats if f"{name}_low" in stats]
    known = {f"{name}{aspect}" for name in names for aspect in ASPECTS} | {"seconds"}

    def told(name: str) -> str:
        return stat(name, stats[name]) if name in stats else "–"

    found = [(name.replace("_", " "), [told(f"{name}{aspect}") for aspect in ASPECTS]) for name in names]
    return found, [(name.replace("_", " "), told(name)) for name in stats if name not in known]


def sentence(text: str) -> str:
    """The text with a capital at its start and one full stop at its end."""
    return text[:1].upper() + text[1:].rstrip(". ") + "."


def without_rounding(force: FloatArray) -> tuple[float, float]:
    """A force of shape (2,) without the component that rounding left, 1e-9 of the other or less."""
    size = np.abs(force).max()
    u, v = (float(component) if abs(component) > 1e-9 * size else 0.0 for component in force)
    return u, v


def beside(value: float, own: float | None) -> Markup:
    """A difference and, if there is one, the own error of what it is a difference from, as HTML.

    A difference that is smaller than that error is set in grey.
    """
    if own is None:
        return Markup("{}").format(number(value, 3))
    kind = "within" if abs(value) < abs(own) else "beyond"
    return Markup('<span class="{}">{}</span><br><span class="unit">±&nbsp;{}</span>').format(
        kind, number(value, 3), number(abs(own), 2)
    )


def own_error_sentence(evaluation: Evaluation) -> str:
    """Sentence on a solver's estimate of its own error."""
    own, markers = evaluation.uncertainty, evaluation.marker_uncertainty
    if own is None or markers is None:
        return f"{evaluation.label} gives no estimate of its own error."
    return (
        f"The error of {evaluation.label} itself, by its own estimate: {percent(own.displacement.rel_l2)} in "
        f"the displacement, {percent(own.von_mises.rel_l2)} in the von Mises stress (relative L²), "
        f"{percent(np.sqrt(abs(own.energy)))} in the energy norm, {distance(markers.max())} mm at most at a "
        "marker."
    )


def indistinct_sentence(label: str, reference: str, names: Sequence[str]) -> str:
    """Sentence on differences that are smaller than the reference's own error; empty without any."""
    if not names:
        return ""
    said = ", ".join(names[:-1]) + (" and " if names[:-1] else "") + names[-1]
    return (
        f"{label} differs from {reference} by less than the own error of {reference} in: {said}. There the "
        "comparison does not say which of the two is nearer to the exact solution."
    )
