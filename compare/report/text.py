"""Words, numbers and sentences of the report."""

from collections.abc import Mapping

from markupsafe import Markup

from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.report.numbers import share
from pinnray.geometry.finger.finger import Finger
from pinnray.runtime.tables import NONE, number
from pinnray.solvers.problem import Load

FINITE_STRAIN = "finite strain: the strain is Green-Lagrange, the stress Cauchy"
LAW_WORDS = {
    "linear": "linear elastic (Hooke), infinitesimal strain",
    "neo-hookean": f"neo-Hookean, {FINITE_STRAIN}",
    "st-venant-kirchhoff": f"St Venant-Kirchhoff, {FINITE_STRAIN}",
    "gent": f"Gent, {FINITE_STRAIN}",
}


def material_rows(comparison: Results) -> list[tuple[str, str]]:
    """The material in words, and the solvers of each law where they differ."""
    material = comparison.material
    constants = f"plane {material.plane}; E = {material.young:g} MPa, Poisson’s ratio {material.poisson:g}"
    solvers: dict[str, list[str]] = {}
    for evaluation in comparison.evaluations:
        solvers.setdefault(evaluation.law, []).append(evaluation.label)
    if len(solvers) == 1:
        return [("Material", f"{LAW_WORDS[next(iter(solvers))]}; {constants}")]
    rows = [(f"Law of {', '.join(labels)}", LAW_WORDS[law]) for law, labels in solvers.items()]
    return [("Material", constants), *rows]


def load_sentence(load: Load, design: Finger) -> str:
    """Sentence on the load."""
    width = f"{design.contact_width:g} mm wide contact"
    friction = f"with friction {load.friction:g}" if load.friction else "without friction"
    where = {
        "mean": f"The weighted mean displacement of the {width} is prescribed",
        "point": "The displacement of one point, the contact’s middle, is prescribed",
        "patch": f"Every point of the {width} has the prescribed displacement",
        "cylinder": f"A rigid cylinder of radius {load.radius or 0:g} mm presses {friction} where it "
        "touches the front, and moves by the prescribed displacement",
    }[load.kind]
    given = zip("uv", load.displacement, strict=True)
    parts = [f"{name} is free" if value is None else f"{name} = {value:g} mm" for name, value in given]
    moved = ", ".join(part.replace("-", "−").replace(" ", "\N{NO-BREAK SPACE}") for part in parts)
    middle = design.contact_abscissa if load.position is None else load.position
    about = f"{'from' if load.kind == 'cylinder' else 'about'} x = {middle:g} mm on the front"
    return f"{where}: {moved}, {about} (load “{load.kind}”)."


def support_sentence(design: Finger) -> str:
    """Sentence on the clamped base."""
    pieces = list(design.section.named("base"))
    length = sum(float(loop.lengths[which]) for loop, which in pieces)
    parts = "" if len(pieces) == 1 else f" in {len(pieces)} pieces"
    return f"The base is clamped ({length:.4g} mm{parts}); all else is free of traction."


def grouped(provenance: Mapping[str, object]) -> list[tuple[str, list[tuple[str, str]]]]:
    """Provenance as groups of lines; single values come first, in a group without a title."""
    groups = {"": {key: value for key, value in provenance.items() if not isinstance(value, Mapping)}}
    groups |= {key: dict(value) for key, value in provenance.items() if isinstance(value, Mapping)}
    named = {
        title: [(str(key).replace("_", " "), in_words(value)) for key, value in lines.items()]
        for title, lines in groups.items()
    }
    return [(title.replace("_", " "), lines) for title, lines in named.items() if lines]


def in_words(value: object) -> str:
    """A value of any kind; a mapping as `name value` pairs."""
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {in_words(inner)}" for key, inner in value.items()) or "defaults"
    return "–" if value is None else str(value)


def symbol(name: str) -> Markup:
    """A symbol of the paper, such as `L_tip`, with its index set as one."""
    letter, _, index = name.partition("_")
    form = Markup("<i>{}</i><sub>{}</sub>") if index else Markup("<i>{}</i>")
    return form.format(letter, index)


ASPECTS = ("", "_deviation", "_low", "_high", "_resolution")
"""Endings of the numbers of a quantity that a solver has found with an interval."""


def found_numbers(stats: Mapping[str, object]) -> list[tuple[str, list[str]]]:
    """The quantities that a solver recorded with an interval, each with its `ASPECTS`."""

    def told(name: str) -> str:
        value = stats.get(name)
        return number(value) if isinstance(value, float | int) else NONE

    names = [name for name in stats if f"{name}_low" in stats]
    return [(name.replace("_", " "), [told(f"{name}{aspect}") for aspect in ASPECTS]) for name in names]


def ending(message: str, stats: Mapping[str, object]) -> str:
    """A solver's message without the numbers that `found_numbers` tells with their intervals."""
    parts = [part for part in message.split("; ") if f"{part.split(' ')[0]}_low" not in stats]
    return sentence("; ".join(parts)) if parts else ""


def sentence(text: str) -> str:
    """The text with a capital at its start and one full stop at its end."""
    return text[:1].upper() + text[1:].rstrip(". ") + "."


def missed_energy(evaluation: Evaluation) -> str:
    """That a result misses energy; empty for others."""
    certificate = evaluation.certificate
    if certificate is None or not certificate.misses_energy:
        return ""
    missed = share(certificate.missed / certificate.fem_energy)
    return (
        f"{evaluation.label} reports {missed} less energy than the least that is possible: its quadrature "
        "misses it."
    )
