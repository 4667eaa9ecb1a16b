"""`fem-3d` on bars with known displacements, and between plane stress and plane strain.

Source: bending: S. P. Timoshenko, J. N. Goodier, Theory of Elasticity, 3rd ed., McGraw-Hill, 1970, article
102; the orders: as for the manufactured solution.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import ufl

from benchmarks.verification.meshes import mapped_mesh, quadrilateral
from benchmarks.verification.record import Case, Row, about, at_most, slope_rows
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.elasticity import energy_density_of
from pinnray.solvers.extrusion import ExtrudedSpace
from pinnray.solvers.fem.dolfinx_compat import DolfinxSpace
from pinnray.solvers.fem.factorisation import Factorisation
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.fem.solid import Fem3dSolver
from pinnray.solvers.problem import Load, Material, Problem

LENGTH, HEIGHT, DEPTH = 4.0, 2.0, 2.0
CURVATURE = 0.01
"""Of the bent bar, 1/mm."""

DECAY = 0.9
"""Of the harmonic function along x, 1/mm."""

CELLS = (2, 4, 8)
"""Elements across the bar, and twice its layers."""

ACROSS = 16
"""Elements across the bar that is compared with the plane states."""

THIN = 0.02
"""Depth of a bar in plane stress, mm."""


def solid() -> tuple[Row, ...]:
    """Error of bending, orders of convergence, and energies over those of the plane states."""
    errors = [harmonic_errors(cells) for cells in CELLS]
    rows = [Row("error of displacement, pure bending", bending_error(), at_most(1e-10), 2, "space")]
    rows += slope_rows(errors, 2, "space", about(3, 0.2), about(2, 0.1))
    for plane, depth, sides, bound in (("strain", DEPTH, "held", 0.002), ("stress", THIN, "free", 0.012)):
        name = f"energy over that of plane {plane}, {'side faces held' if sides == 'held' else 'thin bar'}"
        rows.append(Row(name, energy_over_plane(plane, depth, sides), about(1, bound), 2, "space"))
    return tuple(rows)


def bar(cells: int) -> TriangleMesh:
    """A distorted bar with so many cells across."""
    corners = [(0, -HEIGHT), (LENGTH, -HEIGHT), (LENGTH, 0), (0, 0)]
    return replace(mapped_mesh(quadrilateral(corners), 2 * cells, cells), depth=DEPTH)


def bent(nodes: FloatArray, ν: float) -> FloatArray:
    """Displacement of a bar under end couples, quadratic in the coordinates."""
    x, y, z = nodes.T
    across = -0.5 * (x**2 + ν * (y**2 - z**2))
    return CURVATURE * np.column_stack([x * y, across, -ν * y * z])


def harmonic(nodes: FloatArray) -> FloatArray:
    """Gradient of exp(a x) cos(b y) cos(b z), a² = 2 b²: equilibrium without forces for any constants."""
    b = DECAY / np.sqrt(2)
    x, y, z = nodes.T
    decay = 0.1 * np.exp(DECAY * (x - LENGTH))
    return np.column_stack(
        [
            DECAY * decay * np.cos(b * y) * np.cos(b * z),
            -b * decay * np.sin(b * y) * np.cos(b * z),
            -b * decay * np.cos(b * y) * np.sin(b * z),
        ]
    )


def bending_error() -> float:
    """Error of a bar whose ends are moved as in pure bending, over the largest displacement."""
    material = Material()
    space = ExtrudedSpace.of(bar(3), 2, 0.5)
    exact = bent(space.nodes, material.poisson)
    ends = np.isin(space.nodes[:, 0], [0.0, LENGTH])
    _, nodal = solved(space, material, exact, np.repeat(ends[:, None], 3, axis=1) | space.mirrored)
    return float(np.abs(nodal - exact).max() / np.abs(exact).max())


def harmonic_errors(cells: int) -> tuple[float, float]:
    """Relative errors of a bar moved on all its outside: displacement in L2, stress in the energy norm."""
    space = ExtrudedSpace.of(bar(cells), cells // 2, 1.0)
    outside = np.concatenate([space.boundary_nodes(name) for name in ("left", "right", "bottom", "top")])
    held = space.mirrored
    held[outside] = True
    held[-len(space.section.nodes) :] = True  # the side face
    distributed, nodal = solved(space, Material(), harmonic(space.nodes), held)
    x = ufl.SpatialCoordinate(distributed.domain)
    b = DECAY / np.sqrt(2)
    potential = 0.1 * ufl.exp(DECAY * (x[0] - LENGTH)) * ufl.cos(b * x[1]) * ufl.cos(b * x[2])
    exact = ufl.grad(potential)
    distributed.set_function(nodal)
    gap, measure = distributed.function - exact, ufl.dx(metadata={"quadrature_degree": 6})

    moduli = Material().solid_lame

    def sizes(field: Any) -> FloatArray:
        density = energy_density_of("linear", ufl.grad(field), moduli)
        parts = (ufl.inner(field, field), density)
        return np.sqrt([distributed.assemble_scalar(distributed.form(part * measure)) for part in parts])

    displacement, stress = sizes(gap) / sizes(exact)
    return float(displacement), float(stress)


def solved(
    space: ExtrudedSpace, material: Material, given: FloatArray, held: np.ndarray
) -> tuple[DolfinxSpace[ExtrudedSpace], FloatArray]:
    """The elements, and nodal displacements, (N, 3), mm: those given where a mask (N, 3) holds them."""
    distributed = DolfinxSpace(space)
    moduli = distributed.moduli(material.solid_lame)
    energy = energy_density_of("linear", ufl.grad(distributed.function), moduli) * ufl.dx
    force, stiffness = distributed.derivatives(energy)
    matrix = distributed.assemble_matrix(stiffness, distributed.clamp(held))
    factors = Factorisation(distributed, matrix, held, positive_definite=True)
    prescribed = np.where(held, given, 0.0)
    distributed.set_function(prescribed)
    nodal = prescribed + factors.solve(-distributed.assemble_nodal(force))
    factors.destroy()
    return distributed, nodal


def energy_over_plane(plane: str, depth: float, sides: str) -> float:
    """Energy of a bar of a depth, mm, between clamp and patch, over that of `fem` in a plane state."""
    mesh = bar(ACROSS)
    clamped = replace(
        mesh,
        depth=depth,
        boundaries={**mesh.boundaries, "base": mesh.boundary("left"), "contact": mesh.boundary("top")[-3:]},
    )
    load = Load(kind="patch", displacement=(0.0, -0.1))
    flat = Problem(clamped, Material(plane=plane), load)
    solution = Fem3dSolver(layers=1 if sides == "free" else 2, sides=sides).solve(flat)
    return solution.energy / FemSolver(estimate=False).solve(flat).energy


SOLID = Case(name="three dimensions", answer="closed forms; the plane states", measure=solid)
