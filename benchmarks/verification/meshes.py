"""Structured meshes of mapped squares, distorted."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray

JITTER = 0.2
"""Largest shift of an inner node, in elements: all triangles differ, none is nearly flat."""


def mapped_mesh(mapping: Callable[[FloatArray], FloatArray], columns: int, rows: int) -> TriangleMesh:
    """The image of the unit square, with randomly shifted inner nodes.

    Args:
        mapping: Takes points of the square, shape (n, 2), to points, shape (n, 2), mm; keeps the orientation.
        columns: Elements along the first coordinate.
        rows: Elements along the second.

    Returns:
        Boundaries `left`, `right`, `bottom` and `top` by the sides of the square; the `base` is the bottom,
        the `front` with its `contact` the top.
    """
    s, t = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1), indexing="ij")
    square = np.column_stack([s.ravel(), t.ravel()])
    inner = ((square > 0) & (square < 1)).all(axis=1)
    jitter = np.random.default_rng(0).uniform(-JITTER, JITTER, square.shape) / [columns, rows]
    square[inner] += jitter[inner]
    number = np.arange(len(square)).reshape(columns + 1, rows + 1)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    sides = {"left": number[0], "right": number[-1], "bottom": number[:, 0], "top": number[:, -1]}
    edges = {name: np.column_stack([nodes[:-1], nodes[1:]]) for name, nodes in sides.items()}
    return TriangleMesh(
        points=mapping(square),
        triangles=np.concatenate(
            [np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))]
        ),
        boundaries={"base": edges["bottom"], "front": edges["top"], "contact": edges["top"], **edges},
        marker_nodes=number[1:, rows // 2],
        contact_node=int(number[columns // 2, -1]),
    )


def quadrilateral(corners: ArrayLike) -> Callable[[FloatArray], FloatArray]:
    """The bilinear map of the unit square to a quadrilateral.

    Args:
        corners: Images of (0, 0), (1, 0), (1, 1) and (0, 1), shape (4, 2), mm.
    """
    images = np.asarray(corners, dtype=np.float64)

    def mapping(square: FloatArray) -> FloatArray:
        s, t = square.T
        return np.column_stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t]) @ images

    return mapping
