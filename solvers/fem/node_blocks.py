"""A symmetric matrix of dense blocks, one for each pair of nodes, from matrices of the elements."""

from typing import NamedTuple

import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray, IntArray
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.solvers.symmetric_factors import BlockMatrix


class NodeBlocks(NamedTuple):
    """Where the blocks of the p pairs of nodes (a, b), a <= b, of t elements go in the upper half."""

    pairs: tuple[IntArray, IntArray]  # Of an element's nodes, each of shape (p,)
    swapped: BoolArray  # Mask of the pairs whose second node comes first in the matrix, (t p,)
    order: IntArray  # The pairs by the matrix's k blocks, (t p,)
    starts: IntArray  # First pair of each block in that order, (k,)
    rows: IntArray  # Nodes of the blocks, both of shape (k,)
    columns: IntArray
    nodes: int

    @classmethod
    def of(cls, space: LagrangeSpace) -> "NodeBlocks":
        """Those of a space's elements."""
        a, b = np.triu_indices(space.cell_nodes.shape[1])
        first, second = space.cell_nodes[:, a].ravel(), space.cell_nodes[:, b].ravel()
        key = np.minimum(first, second) * len(space.nodes) + np.maximum(first, second)
        order = np.argsort(key, kind="stable")
        unique, starts = np.unique(key[order], return_index=True)
        rows, columns = np.divmod(unique, len(space.nodes))
        return cls((a, b), first > second, order, starts, rows, columns, len(space.nodes))

    def of_elements(self, local: FloatArray, tangent: FloatArray) -> FloatArray:
        """Blocks (t p, D²) of the elements' pairs.

        Args:
            local: Derivatives and values of an element's n functions at its q points, shape (t, q, 3, n).
            tangent: Of D functions at them by two such derivatives, shape (t, 9 q, D²).
        """
        first, second = (local[..., each] for each in self.pairs)
        products = (first[:, :, :, None] * second[:, :, None]).reshape(*tangent.shape[:2], -1)
        return np.asarray((products.swapaxes(1, 2) @ tangent).reshape(-1, tangent.shape[-1]))

    def matrix(self, blocks: FloatArray, free: BoolArray) -> BlockMatrix:
        """The matrix of blocks (t p, D, D); nodes that are not `free`, (N,), have the unit matrix."""
        blocks[self.swapped] = blocks[self.swapped].swapaxes(-1, -2)
        found = np.add.reduceat(blocks[self.order], self.starts, axis=0)
        found[~(free[self.rows] & free[self.columns])] = 0.0
        found[~free[self.rows] & (self.rows == self.columns)] = np.eye(blocks.shape[-1])
        return BlockMatrix(self.nodes, self.rows, self.columns, found)
