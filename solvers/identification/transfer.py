"""The identified finger at another load.

Walls, law and clamp stay. The contact keeps its distance from the drawn place, its width and the direction of
its force; the feet move in proportion to it. The stroke is not trusted, but its share is: the contact moves
into the finger by the fit's displacement times the ratio of the two loads' displacements.
"""

from dataclasses import replace

import numpy as np

from pinnray.solvers.identification.field import IdentifiedField
from pinnray.solvers.identification.model import EXACT, Response, ResponseModel
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
    return replace(
        solution,
        problem=replace(found.problem, load=other.load),
        field=replace(
            found,
            changes=hypothesis.changes,
            clamp=response.motion,
            body=member.model.body,
            state=response.state,
        ),
        energy=member.model.body.energy(response.state, hypothesis.lame, hypothesis.changes),
        reaction=response.force,
        left_out=None,
        uncertainty=None,
        identified=None,
    )


def _response(model: ResponseModel, start: Response, share: float, shift: float) -> Response:
    """The response at a share of the contact's displacement, the contact shifted along x by mm.

    The size of a patch's force is found by Newton's method, to 1e-5 mm of the contact's displacement; a
    cylinder has that share of its travel.
    """
    names, into = model.unknowns.names, model.unknowns.directions[0]
    target = share * float(start.contact @ into)
    growing = np.isin(names, ("normal_force", "shear_force", "travel", *model.unknowns.feet.names))
    direction, values = np.where(growing, start.values, 0.0), np.where(growing, 0.0, start.values)
    if "position" in names:
        values[names.index("position")] += shift
    model.restart(start)
    scale = share
    for _ in range(12):
        response = model.response(values + scale * direction, EXACT)
        if response is None:
            break
        missed = target - float(response.contact @ into)
        if start.way or abs(missed) < 1e-5:
            return response
        scale += missed / float(direction @ response.contact_slopes @ into)
    raise NoSolutionError("no equilibrium of the identified finger was found at the other load")
