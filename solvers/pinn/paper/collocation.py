"""Collocation points of the energy for the paper's training."""

from typing import Literal

import numpy as np

from pinnray.geometry.mesh.quadrature import body_quadrature
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray

Collocation = Literal["nodes", "elements"]
"""`nodes`: the mesh's nodes, all alike (the paper); `elements`: the rule of degree 2 in every triangle."""


def collocation_points(mesh: TriangleMesh, collocation: Collocation) -> tuple[FloatArray, FloatArray]:
    """Points of the body, shape (n, 2), mm, and their weights in a mean over it, shape (n,), of sum one.

    The mean over nodes is the paper's. It has a bias towards dense parts of the mesh.
    """
    if collocation == "elements":
        rule = body_quadrature(mesh)
        return rule.location.points, rule.weights / rule.weights.sum()
    return mesh.points, np.full(len(mesh.points), 1 / len(mesh.points))
