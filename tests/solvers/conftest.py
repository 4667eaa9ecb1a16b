"""Meshes and references for the tests of the solvers."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.verification.meshes import mapped_mesh, quadrilateral
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.quadrature import body_quadrature
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.observations import Observations
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.problem import Material, Problem
from pinnray.solvers.solution import Solution

SHORT = Design(height=50, rib_count=1, tip_length=12, contact_position=20)
"""A short finger with one rib."""


@pytest.fixture(scope="session")
def short_mesh() -> TriangleMesh:
    """`SHORT` with elements of 1 mm, two across its walls: half the unknowns of the default finger's."""
    return finger_mesh(SHORT, settings=MeshSettings(size=1.0), across=1)


@pytest.fixture(scope="session")
def marked_mesh() -> TriangleMesh:
    """The same finger with nine markers along its front."""
    design = SHORT.replaced(marker_layout="front", marker_count=9)
    return finger_mesh(design, settings=MeshSettings(size=1.0), across=1)


@pytest.fixture(scope="session")
def medium_mesh() -> TriangleMesh:
    """The default finger with elements of 0.5 mm."""
    return finger_mesh(Design(), settings=MeshSettings(size=0.5), across=3)


@pytest.fixture(scope="session")
def medium_fem(medium_mesh):
    """`fem` on the medium mesh with the default load."""
    return FemSolver().solve(Problem(medium_mesh))


def observed_at(points, displacements, deviations, visible=None) -> Observations:
    """Simulated markers of 1.6 mm, all seen unless `visible` is given; `deviations` may be one number."""
    visible = np.ones(len(points), dtype=bool) if visible is None else visible
    deviations = np.broadcast_to(deviations, np.shape(displacements))
    return Observations(points, displacements, deviations, visible, "by a test", True, 0.8)


def hiding(problem: Problem, *markers: int) -> Problem:
    """The problem as if some more of its markers had not been seen."""
    observations = problem.observations
    visible = observations.visible & ~np.isin(np.arange(len(observations.points)), markers)
    return replace(problem, observations=replace(observations, visible=visible))


def bar_mesh(
    length: float, height: float, columns: int, rows: int, *, contact: tuple[float, float]
) -> TriangleMesh:
    """A bar 0 <= x <= length, -height <= y <= 0, with inner nodes moved at random and the contact on its top.

    Args:
        length: mm.
        height: mm.
        columns: Elements along the bar.
        rows: Elements across it.
        contact: Ends of the contact, mm; they must be multiples of length / columns.
    """
    body = quadrilateral([(0, -height), (length, -height), (length, 0), (0, 0)])
    mesh = mapped_mesh(body, columns, rows)
    top = mesh.boundary("top")
    middles = mesh.points[top, 0].mean(axis=1)
    nodes = np.unique(top)
    return replace(
        mesh,
        boundaries={
            "base": mesh.boundary("left"),
            "front": top,
            "contact": top[(middles > contact[0]) & (middles < contact[1])],
            "end": mesh.boundary("right"),
        },
        contact_node=int(nodes[np.argmin(np.abs(mesh.points[nodes, 0] - sum(contact) / 2))]),
    )


def beam_compliance(material: Material, modulus: float, *, height: float, arm: float) -> float:
    """Deflection of Timoshenko's cantilever under a unit force per depth at its arm, mm per N/mm."""
    shear = material.young / (2 * (1 + material.poisson))
    return arm**3 / (3 * modulus * height**3 / 12) + arm / (5 / 6 * shear * height)


def distances(found: Solution, exact: Solution) -> tuple[float, float]:
    """Relative L2 distances of displacement and von Mises stress over the body of the first solution."""
    rule = body_quadrature(found.problem.mesh)
    here = rule.location
    there = here if exact.problem.mesh is found.problem.mesh else exact.problem.mesh.locate(here.points)
    moved = found.displacement(here), exact.displacement(there)
    stressed = found.state(here).von_mises[:, None], exact.state(there).von_mises[:, None]

    def distance(own: FloatArray, other: FloatArray) -> float:
        return float(np.sqrt((rule.weights @ (own - other) ** 2).sum() / (rule.weights @ other**2).sum()))

    return distance(*moved), distance(*stressed)


def check_gradient(solution: Solution, points: np.ndarray, tolerance: float = 1e-6) -> None:
    """The gradient at points (n, 2), mm, is that of central differences of the displacement."""
    step = 1e-5
    for axis in range(2):
        shift = step * np.eye(2)[axis]
        rise = solution.displacement(points + shift) - solution.displacement(points - shift)
        np.testing.assert_allclose(solution.gradient(points)[:, :, axis], rise / (2 * step), atol=tolerance)
