"""Half of the beam in three dimensions, with Taylor-Hood elements: quadratic displacement, linear pressure.

Coordinates are the authors': x is 0 at the tip's face and -100 mm at the clamp, y runs across from 0 to 30 mm
and z up from 0 to 30 mm. Loads, clamp and body are symmetric in y = 15 mm.
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import ufl
from mpi4py import MPI
from scipy.spatial import cKDTree

from benchmarks.validation.laws import LAWS
from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.fem.dolfinx_compat import dolfinx  # type: ignore[attr-defined]
from pinnray.solvers.petsc import PETSc

LENGTH, WIDTH, HEIGHT = 100.0, 30.0, 30.0
"""Of the beam, mm."""

POISSON = 0.499
WEIGHT = 1.07e-6 * 9.80709
"""Density, kg/mm³, times acceleration, m/s², as the authors have them: N/mm³."""

CELLS = (10, 2, 5)
"""Cells along x, half of y, and z at fineness 1; the feet of the markers are nodes of every mesh."""

STRIP = 6.0
"""Height of the strip below the tip's upper edge that carries the load, mm; the highest row of cells."""

TOLERANCE = 1e-9
"""Residual force, N, at which Newton's method ends; the loads are 0.5 to 1.5 N."""

MAX_ITERATIONS = 25


@dataclass(frozen=True, eq=False)
class Deformation:
    """Displacement of the half y <= 15 mm; that of the other half is its mirror image.

    Attributes:
        nodes: Places at rest, shape (n, 3), mm.
        displacement: Shape (n, 3), mm.
        unknowns: All degrees of freedom, from which another solve can start.
    """

    nodes: FloatArray
    displacement: FloatArray
    unknowns: FloatArray

    def at(self, points: FloatArray) -> FloatArray:
        """Displacements (m, 3), mm, of nodes at places (m, 3), mm, in either half.

        Raises:
            UserError: If there is no node at a place.
        """
        mirrored = points[:, 1] > WIDTH / 2
        inside = np.where(mirrored[:, None], points * [1, -1, 1] + [0, WIDTH, 0], points)
        distances, indices = cKDTree(self.nodes).query(inside)
        if distances.max() > 1e-6:
            raise UserError(f"the beam's mesh has no node at {points[distances.argmax()]} mm")
        found = self.displacement[indices]
        return np.where(mirrored[:, None], found * [1, -1, 1], found)


class HalfBeam:
    """Static equilibrium of the clamped beam under its own weight and a load at the tip.

    Attributes:
        nodes: Of the displacement, shape (n, 3), mm.
    """

    def __init__(
        self,
        fineness: int = 1,
        *,
        law: str = "neo-hookean",
        cell: Literal["hexahedron", "tetrahedron"] = "hexahedron",
        strip: float = STRIP,
    ) -> None:
        """Mesh the beam and compile its equations.

        Args:
            fineness: Multiplies the numbers of `CELLS`.
            law: Of `LAWS`.
            cell: Shape of the cells.
            strip: Height of the loaded strip of the tip's face, a multiple of the cells', mm; 0 is the edge.
        """
        mesh = dolfinx.mesh.create_box(
            MPI.COMM_SELF,
            [np.array([-LENGTH, 0, 0]), np.array([0, WIDTH / 2, HEIGHT])],
            [fineness * number for number in CELLS],
            getattr(dolfinx.mesh.CellType, cell),
        )
        space = taylor_hood(mesh, cell)
        of_displacement, dofs = space.sub(0).collapse()
        self._dofs = np.asarray(dofs, dtype=np.int64).reshape(-1, 3)
        self.nodes = of_displacement.tabulate_dof_coordinates()
        self._unknown = dolfinx.fem.Function(space)
        self._moduli = [dolfinx.fem.Constant(mesh, PETSc.ScalarType(1.0)) for _ in range(2)]
        self._weight = dolfinx.fem.Constant(mesh, PETSc.ScalarType((0.0, 0.0, 0.0)))
        u, p = ufl.split(self._unknown)
        dx = ufl.dx(metadata={"quadrature_degree": 4})
        energy = (LAWS[law](ufl.Identity(3) + ufl.grad(u), p, *self._moduli) - ufl.dot(self._weight, u)) * dx
        force = ufl.derivative(energy, self._unknown, ufl.TestFunction(space))
        self._force = dolfinx.fem.form(force)
        self._tangent = dolfinx.fem.form(ufl.derivative(force, self._unknown, ufl.TrialFunction(space)))
        clamped = self._dofs[np.isclose(self.nodes[:, 0], -LENGTH)].ravel()
        across = self._dofs[np.isclose(self.nodes[:, 1], WIDTH / 2), 1]
        self._held = np.union1d(clamped, across)
        held = dolfinx.fem.dirichletbc(dolfinx.fem.Function(space), self._held.astype(np.int32))
        self._conditions = [held]
        self._loaded, self._shares = loaded_nodes(self.nodes, strip)

    def solve(
        self, modulus: float, load: float, *, tilt: float = 0.0, start: Deformation | None = None
    ) -> Deformation:
        """Equilibrium under the weight and a load.

        Args:
            modulus: Young's modulus, MPa.
            load: On both halves of the tip together, N.
            tilt: Angle from -z to the vertical, positive towards the tip, radians.
            start: Of Newton's method, on the same mesh; rest if None.

        Raises:
            UserError: If Newton's method does not converge.
        """
        down = np.array([np.sin(tilt), 0.0, -np.cos(tilt)])
        λ = modulus * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
        for constant, value in zip(self._moduli, (λ, modulus / (2 * (1 + POISSON))), strict=True):
            constant.value = value
        self._weight.value = WEIGHT * down
        unknowns = np.zeros_like(self._unknown.x.array) if start is None else start.unknowns.copy()
        for _ in range(MAX_ITERATIONS):
            self._unknown.x.array[:] = unknowns
            residual = dolfinx.fem.petsc.assemble_vector(self._force)
            residual.array[self._dofs[self._loaded]] -= load * self._shares[:, None] * down
            residual.array[self._held] = 0
            size = residual.norm(PETSc.NormType.INFINITY)
            if size < TOLERANCE:
                return Deformation(self.nodes, unknowns[self._dofs], unknowns)
            if not np.isfinite(size):
                break
            unknowns -= self._solved(residual)
        raise UserError(f"no equilibrium of the beam found for {modulus:g} MPa and {load:g} N: start nearer")

    def _solved(self, residual: PETSc.Vec) -> FloatArray:
        """Newton's step, by MUMPS; the matrix is symmetric and indefinite."""
        matrix = dolfinx.fem.petsc.assemble_matrix(self._tangent, bcs=self._conditions)
        matrix.assemble()
        matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        solver = PETSc.KSP().create(MPI.COMM_SELF)
        solver.setOperators(matrix)
        solver.setType(PETSc.KSP.Type.PREONLY)
        solver.setErrorIfNotConverged(True)
        factors = solver.getPC()
        factors.setType(PETSc.PC.Type.CHOLESKY)
        factors.setFactorSolverType(PETSc.Mat.SolverType.MUMPS)
        step = residual.duplicate()
        solver.solve(residual, step)
        values = step.array.copy()
        for item in (factors, solver, matrix, step, residual):
            item.destroy()  # petsc4py would keep the factors for ever
        return values


def taylor_hood(mesh: Any, cell: str) -> Any:
    """Displacement of degree 2 and pressure of degree 1, in DOLFINx from 0.5 (Debian 12) on."""
    if hasattr(ufl, "MixedElement"):  # until 0.6
        displacement = ufl.VectorElement("Lagrange", mesh.ufl_cell(), 2)
        pressure = ufl.FiniteElement("Lagrange", mesh.ufl_cell(), 1)
        return dolfinx.fem.FunctionSpace(mesh, ufl.MixedElement(displacement, pressure))
    import basix.ufl

    parts = [basix.ufl.element("Lagrange", cell, 2, shape=(3,)), basix.ufl.element("Lagrange", cell, 1)]
    return dolfinx.fem.functionspace(mesh, basix.ufl.mixed_element(parts))  # type: ignore[attr-defined]


def loaded_nodes(nodes: FloatArray, strip: float) -> tuple[IntArray, FloatArray]:
    """Nodes of the loaded strip and their shares of a uniform load, which add up to 1/2 on this half.

    Simpson's rule in y and z is the exact one for quadratic hexahedra, and for tetrahedra on the edge.
    """
    loaded = np.flatnonzero((nodes[:, 0] > -1e-9) & (nodes[:, 2] > HEIGHT - strip - 1e-9))
    shares = np.full(len(loaded), 0.5)
    for axis in (1, 2):
        places, index = np.unique(nodes[loaded, axis].round(6), return_inverse=True)
        weights = np.ones(len(places))
        weights[1:-1:2], weights[2:-1:2] = 4, 2
        shares *= (weights / weights.sum())[index]
    return loaded, shares
