"""`fem`: refinement, plane states, advice; `tests/verification` has the exact solutions."""

import numpy as np
import pytest

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.runtime.errors import UserError
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Load, Material, Problem


@pytest.mark.slow
def test_marker_displacements_have_converged():
    """h = 0.25 mm against 0.125 mm; the point load drifts with every halving: its limit does not exist."""
    for kind, limits in {"mean": (0.002, 0.005), "point": (0.004, 0.007)}.items():
        coarse, fine = (
            FemSolver(estimate=False).solve(
                Problem(finger_mesh(Design(), settings=MeshSettings(size=size)), load=Load(kind=kind))
            )
            for size in (0.25, 0.125)
        )
        markers = coarse.problem.mesh.markers
        difference = np.abs(coarse.displacement(markers) - fine.displacement(markers)).mean(axis=0)
        assert (difference <= limits).all(), (kind, difference)


def test_energy_falls_under_refinement(coarse_mesh, medium_mesh, medium_fem):
    """The discrete energy of a displacement-driven problem is never below that of a finer space."""
    linear = FemSolver(degree=1).solve(Problem(coarse_mesh)).energy
    quadratic = FemSolver(degree=2).solve(Problem(coarse_mesh)).energy
    assert linear > quadratic > medium_fem.energy > 0.98 * quadratic


@pytest.mark.parametrize(
    ("degree", "poisson", "plane", "locks"),
    [
        (1, 0.45, "strain", "about 1.7 times"),
        (1, 0.4999, "strain", "more than 5 times"),
        (1, 0.4, "strain", ""),
        (1, 0.45, "stress", ""),  # nothing keeps the volume
        (2, 0.4999, "strain", ""),
    ],
)
def test_status_says_that_linear_elements_lock(coarse_mesh, degree, poisson, plane, locks):
    problem = Problem(coarse_mesh, Material(poisson=poisson, plane=plane))
    message = FemSolver(degree=degree, estimate=False).solve(problem).status.message
    assert locks in message
    assert ("lock" in message) == bool(locks)


def test_a_solution_that_rounding_has_spoilt_is_refused(short_mesh):
    """The energy would be a third too large. One digit less of Poisson's ratio is enough for a solution."""
    spoilt, sound = (Problem(short_mesh, Material(poisson=0.5 - away)) for away in (1e-12, 1e-7))
    with pytest.raises(UserError, match=r"rounding has spoilt .* Poisson's ratio farther from 0.5"):
        FemSolver().solve(spoilt)
    usual = FemSolver().solve(Problem(short_mesh, Material(poisson=0.4999))).energy
    assert FemSolver().solve(sound).energy == pytest.approx(usual, rel=1e-3)
