"""The identified finger at another load.

Walls, law and clamp stay. The contact keeps its distance from the drawn place, its width and the direction of
its force; the feet move in proportion to it. The stroke is not trusted, but its share is: the contact moves
into the finger by the fit's displacement times the ratio of the two loads' displacements.
"""

from dataclasses import replace

import numpy as np

from pinnray.solvers.identification.field import IdentifiedField
from pinnray.solvers.identification.model import EXACT, Response, ResponseModel
from pinnray.solvers.identification.unknowns import INDENTATION
from pinnray.solvers.problem import Problem, contact_ends
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import NoSolutionError


def transferred(solution: Solution, problem: Problem, other: Problem) -> Solution:
    """The solution of another problem with the finger of a solution.

    Args:
        solution: With an `IdentifiedField`.
        problem: The problem that it solves.
        other: The same finger under another load.

    Raises:
        UserError: If no equilibrium is found there.
    """
    if not isinstance(solution.field, IdentifiedField):
        return replace(solution, problem=other)
    member = solution.field.members[0]
    share = float(np.linalg.norm(other.load.values) / np.linalg.norm(problem.load.values))
    shift = float(np.mean(contact_ends(other)) - np.mean(contact_ends(problem)))
    response = _response(member.model, member.response, share, shift)
    hypothesis, found = response.hypothesis, member.found
    body, state = member.model.body, response.state
    return replace(
        solution,
        problem=replace(found.problem, load=other.load),
        field=replace(found, changes=hypothesis.changes, clamp=response.motion, body=body, state=state),
        energy=body.energy(state, hypothesis.lame, hypothesis.changes),
        reaction=response.force,
        left_out=None,
        uncertainty=None,
        identified=None,
    )


def _response(model: ResponseModel, start: Response, share: float, shift: float) -> Response:
    """The response at a share of the contact's indentation, the contact shifted along x by mm.

    What grows with the normal force follows it, to a millionth, by iteration; a cylinder has that share of
    its travel, on a way of its own.
    """
    names, into = model.unknowns.names, model.unknowns.directions[0]
    values = start.values.copy()
    values[names.index("travel" if start.way else INDENTATION)] *= share
    growing = np.isin(names, ("shear_force", *model.unknowns.feet.names))
    if "position" in names:
        values[names.index("position")] += shift
    model.restart(None if start.way else start)
    scale = share
    for _ in range(12):
        response = model.response(np.where(growing, scale * values, values), EXACT)
        if response is None:
            break
        before, scale = scale, float(response.force @ into / (start.force @ into))
        if start.way or abs(scale - before) < 1e-6:
            return response
    raise NoSolutionError("no equilibrium of the identified finger was found at the other load")
