"""Meshes and references for the tests of the solvers."""

import numpy as np
import pytest

from geometry.cache import finger_mesh
from geometry.design import Design
from geometry.mesh import TriangleMesh
from geometry.settings import MeshSettings
from solvers.fem.linear import FemSolver
from solvers.problem import Problem


@pytest.fixture(scope="session")
def medium_mesh() -> TriangleMesh:
    """The default finger with elements of 0.5 mm."""
    return finger_mesh(Design(), settings=MeshSettings(size=0.5))


@pytest.fixture(scope="session")
def medium_fem(medium_mesh):
    """`fem` on the medium mesh with the default load."""
    return FemSolver().solve(Problem(medium_mesh))


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
    x, y = np.meshgrid(np.linspace(0, length, columns + 1), np.linspace(-height, 0, rows + 1), indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel()])
    inner = (points[:, 0] > 0) & (points[:, 0] < length) & (points[:, 1] < 0) & (points[:, 1] > -height)
    jitter = np.random.default_rng(0).uniform(-0.2, 0.2, points.shape) * [length / columns, height / rows]
    points[inner] += jitter[inner]
    number = np.arange(len(points)).reshape(columns + 1, rows + 1)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    triangles = np.concatenate(
        [np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))]
    )
    top = np.column_stack([number[:-1, -1], number[1:, -1]])
    middles = points[top, 0].mean(axis=1)
    return TriangleMesh(
        points=points,
        triangles=triangles,
        boundaries={
            "base": np.column_stack([number[0, :-1], number[0, 1:]]),
            "front": top,
            "contact": top[(middles > contact[0]) & (middles < contact[1])],
            "end": np.column_stack([number[-1, :-1], number[-1, 1:]]),
        },
        marker_nodes=number[1:, rows // 2],
        contact_node=int(number[np.argmin(np.abs(x[:, 0] - sum(contact) / 2)), -1]),
    )
