"""Parameters that `fem-id` can find, and their priors."""

from collections.abc import Mapping, Sequence
from math import log

import numpy as np

from geometry.errors import UserError
from geometry.mesh.boundary import walls_and_ribs
from solvers.assimilation.estimation import Parameter
from solvers.problem import Load, Problem, contact_ends
from solvers.solver import UnsupportedProblemError

MEANINGS = {
    "position": "abscissa of the contact's middle",
    "stroke_u": "travel of the contact along the finger",
    "stroke_v": "travel of the contact across the finger",
    "base_compliance": "how far the base gives under a traction of Young's modulus",
    "poisson": "Poisson's ratio",
    "front_stiffness": "factor of Young's modulus in the front wall",
    "back_stiffness": "factor of Young's modulus in the back wall",
    "rib_stiffness": "factor of Young's modulus in the ribs",
    "young": "Young's modulus",
}
"""Every parameter, with its description."""

STIFFNESS = {"front_stiffness": "front", "back_stiffness": "back", "rib_stiffness": "rib"}
"""Part of the finger of each stiffness parameter."""


def parameters_of(problem: Problem, names: Sequence[str], width: float = 1.0) -> list[Parameter]:
    """The parameters with their priors.

    Args:
        problem: Its values are the means of the priors.
        names: Keys of `MEANINGS`.
        width: Factor of the standard deviations of the priors.

    Raises:
        UserError: If the problem has no such parameter.
    """
    mesh, load, material = problem.mesh, problem.load, problem.material
    left, right = contact_ends(problem)
    front = mesh.points[mesh.boundary("front").ravel(), 0]
    half = 0.5 * (right - left) if load.kind != "point" else 0.0
    travel = float(np.abs(load.values).max()) or 1.0
    parts = walls_and_ribs(mesh) if set(names) & set(STIFFNESS) else {}
    found = []
    for name in names:
        if name.startswith("stroke") and load.displacement["uv".index(name[-1])] is None:
            raise UnsupportedProblemError(
                f"{name[-1]} of the load is free, so that there is no {name} to find"
            )
        if name in STIFFNESS and not parts[STIFFNESS[name]].any():
            raise UserError(f"this finger has no {STIFFNESS[name]} beside cavities: leave out {name}")
        if name == "position" and load.kind == "patch":
            raise UnsupportedProblemError(
                "a patch lies on whole elements and cannot move: leave out position"
            )
        found.append(
            {
                "position": Parameter(
                    name, "mm", 0.5 * (left + right), 2.0 * width, front.min() + half, front.max() - half
                ),
                "stroke_u": Parameter(name, "mm", load.displacement[0] or 0.0, 0.2 * travel * width),
                "stroke_v": Parameter(name, "mm", load.displacement[1] or 0.0, 0.2 * travel * width),
                "base_compliance": Parameter(name, "mm", 0.1, log(10) * width, logarithmic=True),
                "poisson": Parameter(name, "", material.poisson, 0.05 * width, 0.0, 0.499),
                "young": Parameter(name, "MPa", material.young, 0.3 * width, logarithmic=True),
            }.get(name, Parameter(name, "", 1.0, 0.3 * width, logarithmic=True))
        )
    return found


def problem_with(problem: Problem, values: Mapping[str, float]) -> Problem:
    """The problem with the values for its load and material; others are ignored."""
    load, material = problem.load, problem.material
    u, v = (
        values.get(name, known)
        for name, known in zip(("stroke_u", "stroke_v"), load.displacement, strict=True)
    )
    position = values.get("position", load.position)
    own = {name: values[name] for name in ("young", "poisson") if name in values}
    return Problem(
        problem.mesh,
        material.model_copy(update=own),
        Load(kind=load.kind, displacement=(u, v), position=position, radius=load.radius),
        problem.observations,
    )
