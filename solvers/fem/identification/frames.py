"""The force from frame to frame by finite elements."""

from collections.abc import Sequence
from dataclasses import replace

from geometry.arrays import FloatArray
from solvers.assimilation.misfit import radius_within
from solvers.elasticity import LawName
from solvers.fem.identification.body import FemBody
from solvers.identification.frame_by_frame import ForceTracker, LawTracker
from solvers.identification.hypothesis import DEFAULT, Unknowns
from solvers.identification.response import ResponseModel
from solvers.identification.settings import LAWS
from solvers.lagrange import LagrangeSpace
from solvers.problem import Problem


def fem_force_tracker(
    problem: Problem, points: FloatArray, radius: float, *, degree: int = 2, prior: float = 1.0
) -> ForceTracker:
    """The force tracker of a finger in finite elements.

    Args:
        problem: The finger with a law of finite strain; its load only gives the drawn contact.
        points: Markers at rest, shape (m, 2), mm, in the drawn body.
        radius: Of the markers' discs, mm; less is taken where one is nearer to the boundary.
        degree: Of the elements, 1 or 2.
        prior: Factor of the standard deviations of the priors.
    """
    unknowns = Unknowns.of(replace(problem, observations=None), DEFAULT)
    body = FemBody(unknowns.problem, LagrangeSpace(problem.mesh, degree), unknowns.motion)
    inside = radius_within(problem.mesh, points, radius)
    return ForceTracker(ResponseModel(body, unknowns), points, inside, prior=prior)


def fem_law_tracker(
    problem: Problem, points: FloatArray, radius: float, laws: Sequence[LawName] = LAWS
) -> LawTracker:
    """The same by the most probable of some laws of finite strain, in elements of degree 2."""
    trackers = {}
    for law in laws:
        own = replace(problem, material=problem.material.model_copy(update={"law": law}))
        trackers[law] = fem_force_tracker(own, points, radius)
    return LawTracker(trackers)
