"""Vector spaces with DOLFINx from 0.5 (Debian 12) to 0.11, behind one interface."""

import inspect
import logging
import warnings
from collections.abc import Callable, Sequence
from contextlib import chdir, suppress
from dataclasses import dataclass
from pathlib import Path
from time import time
from typing import Any, Generic, TypeVar

import numpy as np

from pinnray.runtime.arrays import BoolArray, FloatArray, IntArray
from pinnray.solvers.elasticity import Lame
from pinnray.solvers.extrusion import NodalSpace
from pinnray.solvers.lagrange import LagrangeSpace

# Before DOLFINx, which would start PETSc with files of the working folder.
from pinnray.solvers.petsc import PETSc

with warnings.catch_warnings():  # undoes that FFCx sends all warnings of the program into a log
    import dolfinx
    import dolfinx.fem.petsc
    import ffcx
    import ufl
    from mpi4py import MPI

# DOLFINx and FFCx read their option files once: here, from a folder without any. A file of others in the
# working folder could choose the compiler's flags and the text that it compiles.
with chdir(Path(dolfinx.__file__).parent):
    for package in (dolfinx.jit, ffcx):
        (getattr(package, "get_options", None) or package.get_parameters)()  # until 0.5

DOLFINX_EDGES = {
    2: np.array([[1, 2], [0, 2], [0, 1]]),
    3: np.array([[2, 3], [1, 3], [1, 2], [0, 3], [0, 2], [0, 1]]),
}
"""The corners that each edge of a simplex joins, in the order of DOLFINx."""

ABANDONED_S = 120.0
"""Age at which a form that is not compiled has been given up, s."""
CLOCK_STEP_S = 0.02
"""How far the time of a file's last change may lag behind `time.time()`, s: two ticks at 100 Hz."""


def _create_mesh(cells: IntArray, points: FloatArray) -> Any:
    dimension = points.shape[1]
    cell = {2: "triangle", 3: "tetrahedron"}[dimension]
    if hasattr(ufl, "VectorElement"):  # until 0.6
        element = ufl.VectorElement("Lagrange", cell, 1)
    else:
        import basix.ufl

        element = basix.ufl.element("Lagrange", cell, 1, shape=(dimension,))
    domain = ufl.Mesh(element)
    names = inspect.signature(dolfinx.mesh.create_mesh).parameters
    return dolfinx.mesh.create_mesh(
        MPI.COMM_SELF, cells=cells, x=points, **{"domain" if "domain" in names else "e": domain}
    )


def _vector_space(mesh: Any, degree: int) -> Any:
    if hasattr(dolfinx.fem, "functionspace"):  # from 0.7
        return dolfinx.fem.functionspace(mesh, ("Lagrange", degree, (mesh.geometry.dim,)))
    return dolfinx.fem.VectorFunctionSpace(mesh, ("Lagrange", degree))


def _nodes_of_dofs(space: NodalSpace, domain: Any, dolfinx_space: Any) -> IntArray:
    """The node of the `NodalSpace` at every blocked degree of freedom.

    A cell of DOLFINx has them at its corners and, for degree 2, at the middles of `DOLFINX_EDGES`.
    """
    dimension = space.nodes.shape[1]
    geometry = domain.geometry
    table = geometry.dofmaps[0] if hasattr(geometry, "dofmaps") else geometry.dofmap  # until 0.10
    nodes = space.vertices[np.asarray(geometry.input_global_indices)[_rows(table, dimension + 1)]]
    if space.degree == 2:
        nodes = np.concatenate([nodes, space.edge_nodes(nodes[:, DOLFINX_EDGES[dimension]])], axis=1)
    positions = dolfinx_space.tabulate_dof_coordinates()[:, :dimension]
    node_of_dof = np.zeros(len(positions), dtype=np.int64)
    node_of_dof[_rows(dolfinx_space.dofmap.list, nodes.shape[1])] = nodes
    if not np.allclose(space.nodes[node_of_dof], positions, rtol=0, atol=1e-9):
        raise RuntimeError("the degrees of freedom of DOLFINx are numbered in another way than expected")
    return node_of_dof


def _rows(table: Any, width: int) -> IntArray:
    """A table of DOLFINx with one row a cell: an array from 0.7 on, an adjacency list before."""
    return np.asarray(getattr(table, "array", table)).reshape(-1, width)


Built = TypeVar("Built")


def _compiled(build: Callable[[], Built]) -> Built:
    """The result of a call of DOLFINx, without the build log that distutils prints through the root logger.

    An interruption leaves nothing half compiled, for which later runs would wait. A kill does: FFCx waits for
    it, and what is older than `ABANDONED_S` then is compiled again.
    """
    before, began = logging.root.manager.disable, time() - CLOCK_STEP_S
    logging.disable(logging.INFO)
    try:
        while True:
            try:
                return build()
            except TimeoutError:  # of FFCx, which has waited
                _forget_half_compiled(lambda changed: changed < time() - ABANDONED_S)
    except KeyboardInterrupt:  # of other exceptions FFCx takes care
        _forget_half_compiled(lambda changed: changed >= began)
        raise
    finally:
        logging.disable(before)


def _forget_half_compiled(chosen: Callable[[float], bool]) -> None:
    """Delete sources that FFCx has not compiled to the end, chosen by the time of their last change, s."""
    options: Any = getattr(dolfinx.jit, "get_options", None) or dolfinx.jit.get_parameters  # until 0.5
    for source in Path(options()["cache_dir"]).glob("libffcx_*.c"):
        with suppress(OSError):  # another process may have deleted it
            if not source.with_suffix(".c.cached").exists() and chosen(source.stat().st_mtime):
                source.unlink()


SpaceT = TypeVar("SpaceT", bound=NodalSpace)


class DolfinxSpace(Generic[SpaceT]):
    """A DOLFINx vector space on the shared mesh, or its extrusion.

    Nodal arrays of shape (N, d) have the numbering of the elements in NumPy, `space`, and those of PETSc that
    of DOLFINx. Forms are written with `function`.
    """

    def __init__(self, space: SpaceT) -> None:
        self.space, self.dimension = space, space.nodes.shape[1]
        self.domain = _create_mesh(space.cells, space.nodes[space.vertices])
        self.dolfinx_space = _compiled(lambda: _vector_space(self.domain, space.degree))
        self.function = dolfinx.fem.Function(self.dolfinx_space)
        self._node_of_dof = _nodes_of_dofs(space, self.domain, self.dolfinx_space)

    def move(self, points: FloatArray) -> None:
        """Put the corners of the cells at other points, shape (n, d), mm."""
        where = np.asarray(self.domain.geometry.input_global_indices)
        self.domain.geometry.x[:, : self.dimension] = points[where]

    def moduli(self, lame: Lame) -> Lame:
        """Lamé's constants λ and μ as numbers that can change without compiling a form again."""
        λ, μ = (dolfinx.fem.Constant(self.domain, PETSc.ScalarType(value)) for value in lame[:2])
        return Lame(λ, μ, lame.λ_out)

    def form(self, expression: Any) -> Any:
        """Compile a UFL form."""
        return _compiled(lambda: dolfinx.fem.form(expression))

    def derivatives(self, energy: Any) -> tuple[Any, Any]:
        """Compile the first and the second derivative of an energy, a UFL form, by `function`."""
        space = self.function.function_space
        force = ufl.derivative(energy, self.function, ufl.TestFunction(space))
        return self.form(force), self.form(ufl.derivative(force, self.function, ufl.TrialFunction(space)))

    def clamp(self, clamped: BoolArray) -> list[Any]:
        """Homogeneous Dirichlet conditions on the components of a mask of shape (N, d)."""
        zero, conditions = PETSc.ScalarType(0.0), []
        for axis, held in enumerate(clamped[self._node_of_dof].T):
            # A sub-space numbers its degrees of freedom within the blocked parent.
            dofs = (self.dimension * np.flatnonzero(held) + axis).astype(np.int32)
            conditions.append(dolfinx.fem.dirichletbc(zero, dofs, self.dolfinx_space.sub(axis)))
        return conditions

    def assemble_matrix(
        self, form: Any, conditions: Sequence[Any], *, into: PETSc.Mat | None = None
    ) -> PETSc.Mat:
        """Matrix of a compiled form, with the identity in rows and columns of clamped components.

        It overwrites `into`, an earlier matrix of the form, if there is one.
        """
        if into is not None:
            into.zeroEntries()
        assemble: Any = dolfinx.fem.petsc.assemble_matrix
        matrix = assemble(*(() if into is None else (into,)), form, bcs=list(conditions))
        matrix.assemble()
        return matrix

    def add_blocks(self, matrix: PETSc.Mat, nodes: IntArray, blocks: FloatArray) -> None:
        """Add blocks of shape (m, d, d) to a matrix, each on the diagonal of one of m different nodes."""
        row_of_node = np.empty(len(self.space.nodes), dtype=np.int32)
        row_of_node[self._node_of_dof] = np.arange(len(row_of_node))
        for row, block in zip(row_of_node[nodes], blocks, strict=True):
            matrix.setValuesBlockedLocal(row, row, block, addv=PETSc.InsertMode.ADD_VALUES)
        matrix.assemble()

    def assemble_nodal(self, form: Any) -> FloatArray:
        """A linear form on every shape function, shape (N, d)."""
        vector = dolfinx.fem.petsc.assemble_vector(form)
        nodal = self.nodal(vector.array_r)
        vector.destroy()  # petsc4py would keep it for ever
        return nodal

    def assemble_scalar(self, form: Any) -> float:
        """An integral over the whole body."""
        return float(dolfinx.fem.assemble_scalar(form))

    def node_function(self, degree: int = 1) -> "NodeFunction":
        """A continuous vector field of a degree in every triangle, that forms can be written with; zero."""
        space = _compiled(lambda: _vector_space(self.domain, degree))
        nodes = _nodes_of_dofs(LagrangeSpace(self.space.mesh, degree), self.domain, space)
        return NodeFunction(dolfinx.fem.Function(space), nodes)

    def set_function(self, values: FloatArray) -> None:
        """Give `function` nodal values of shape (N, d)."""
        self.function.x.array[:] = self.dofs(values)

    def dofs(self, values: FloatArray) -> FloatArray:
        """Degrees of freedom, shape (..., d N), of nodal values, (..., N, d)."""
        return values[..., self._node_of_dof, :].reshape(*values.shape[:-2], -1)

    def nodal(self, dofs: FloatArray) -> FloatArray:
        """Nodal values, shape (..., N, d), of degrees of freedom, (..., d N)."""
        values = np.empty((*dofs.shape[:-1], *self.space.nodes.shape))
        values[..., self._node_of_dof, :] = dofs.reshape(values.shape)
        return values


@dataclass(frozen=True, eq=False)
class NodeFunction:
    """A vector field given at the nodes of the mesh, as a function of DOLFINx."""

    function: Any
    node_of_dof: IntArray

    def set(self, values: FloatArray) -> None:
        """Give it values of shape (number of the mesh's nodes, 2)."""
        self.function.x.array[:] = values[self.node_of_dof].ravel()
