"""`fem`, `fem-nonlinear` and `fem-3d` against CalculiX on the same mesh, where `ccx` is installed.

Source: CalculiX CrunchiX 2.20 by G. Dhondt and K. Wittig, Debian's package calculix-ccx.
"""

import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from benchmarks.verification.record import Case, Row, at_most
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.elasticity import check_known
from pinnray.solvers.extrusion import ExtrudedSpace
from pinnray.solvers.fem.boundary_conditions import dirichlet_conditions
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.fem.solid import Fem3dSolver
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.solvers.problem import Load, Material, Problem

PROGRAM = "ccx"
SECONDS = 900.0
"""Time after which a run of `ccx` is given up."""

BOUNDS = {"linear": (2e-6, 2e-6), "st-venant-kirchhoff": (5e-5, 5e-4)}
"""Of the differences of displacement and force; the first pair is that of seven printed digits."""

TETRAHEDRON = np.array([[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]])
"""Corners that each edge of a quadratic tetrahedron joins, in the order of CalculiX."""


class Answer(NamedTuple):
    """Displacements of the nodes, shape (N, d), mm, and the force on the contact, shape (d,), N."""

    displacement: FloatArray
    force: FloatArray


def calculix() -> tuple[Row, ...]:
    """Differences of displacement and force, in the plane and in space, linear and at finite strain."""
    # In space a short finger with one rib, because the other program's solver takes long.
    short = Design(height=50, rib_count=1, tip_length=12, contact_position=20, depth=6.0)
    plane, solid = (finger_mesh(design, settings=MeshSettings(size=1.0)) for design in (Design(), short))
    rows = []
    for law, bounds in BOUNDS.items():
        in_plane = Problem(plane, Material(law=law), Load(kind="patch", displacement=(None, -10.0)))
        in_space = Problem(solid, Material(law=law), Load(kind="patch", displacement=(None, -4.0)))
        for place, differences in (
            ("strain", plane_differences(in_plane)),
            ("space", solid_differences(in_space)),
        ):
            for what, difference, bound in zip(("displacement", "force"), differences, bounds, strict=True):
                rows.append(Row(f"difference of the {what}, {law}", difference, at_most(bound), 2, place))
    return tuple(rows)


def plane_differences(problem: Problem) -> tuple[float, float]:
    """Relative differences of the displacement, max norm, and of the force in plane strain."""
    linear = problem.material.law == "linear"
    ours = (FemSolver(estimate=False) if linear else FemNonlinearSolver()).solve(problem)
    space = LagrangeSpace(problem.mesh, 2)
    theirs = solve(problem, space)
    away = np.abs(ours.displacement(space.nodes) - theirs.displacement).max()
    size = np.abs(theirs.displacement).max()
    return float(away / size), float(abs(ours.reaction[1] / theirs.force[1] - 1))


def solid_differences(problem: Problem) -> tuple[float, float]:
    """The same for the side face and the force of `fem-3d`."""
    solver = Fem3dSolver(layers=1)
    ours, space = solver.solve(problem), solver.space(problem)
    theirs = solve(problem, space)
    side = space.at_level(theirs.displacement, -1)[:, :2]
    away = np.abs(ours.displacement(space.section.nodes) - side).max() / np.abs(side).max()
    return float(away), float(abs(ours.reaction[1] * space.thickness / theirs.force[1] - 1))


def solve(problem: Problem, space: LagrangeSpace | ExtrudedSpace) -> Answer:
    """Solution by `ccx` of a problem with a patch; elements, quadrature and solver are its own.

    Raises:
        UserError: If `ccx` does not finish.
    """
    return solved(deck(problem, space), len(space.nodes), space.nodes.shape[1])


def solved(lines: str, nodes: int, dimension: int) -> Answer:
    """What `ccx` prints last for an input of so many nodes; a `UserError` if it does not finish."""
    with TemporaryDirectory() as folder:
        (Path(folder) / "job.inp").write_text(lines, encoding="ascii")
        run = subprocess.run(
            [PROGRAM, "-i", "job"], cwd=folder, capture_output=True, text=True, timeout=SECONDS, check=False
        )
        output = Path(folder) / "job.dat"
        printed = output.read_text(encoding="ascii") if output.is_file() else ""
    values = table(printed, "displacements")
    if run.returncode or "*ERROR" in run.stdout or len(values) != nodes:
        raise UserError(f"ccx has not solved the problem; its last words: {run.stdout.strip()[-200:]}")
    return Answer(values[:, 1 : dimension + 1], table(printed, "total force")[0, :dimension])


def table(printed: str, title: str) -> FloatArray:
    """Numbers of the last table of a `.dat` file whose title begins so, one row a line."""
    *_, last = printed.split(f" {title}") if f" {title}" in printed else ("",)
    lines = last.partition("\n")[2].strip("\n").split("\n\n")[0].splitlines()
    return np.array([[float(word) for word in line.split()] for line in lines if line.strip()])


def deck(problem: Problem, space: LagrangeSpace | ExtrudedSpace) -> str:
    """Input of `ccx`: nodes, quadratic elements, one step; plane elements are 1 mm deep.

    Raises:
        UserError: If the material has another law than those of `BOUNDS`, or is in plane stress.
    """
    check_known("law", problem.material.law, tuple(BOUNDS))
    check_known("plane state", problem.material.plane, ("strain",))
    solid = isinstance(space, ExtrudedSpace)
    held, values = dirichlet_conditions(problem, space)
    conditions = [
        f"{node + 1},{axis + 1},{axis + 1},{values[node, axis]:.12g}" for node, axis in np.argwhere(held)
    ]
    places = space.nodes if solid else np.pad(space.nodes, ((0, 0), (0, 1)))
    return "\n".join(
        [
            "*NODE, NSET=ALL",
            *(f"{number},{x:.12g},{y:.12g},{z:.12g}" for number, (x, y, z) in enumerate(places.tolist(), 1)),
            f"*ELEMENT, TYPE={'C3D10' if solid else 'CPE6'}, ELSET=BODY",
            *(",".join(map(str, [number, *(nodes + 1)])) for number, nodes in enumerate(cells(space), 1)),
            "*NSET, NSET=CONTACT",
            *(str(node + 1) for node in space.boundary_nodes("contact")),
            "*MATERIAL, NAME=RUBBER",
            "*ELASTIC",
            f"{problem.material.young:.12g},{problem.material.poisson:.12g}",
            "*SOLID SECTION, ELSET=BODY, MATERIAL=RUBBER",
            *([] if solid else ["1."]),
            "*STEP" if problem.material.law == "linear" else "*STEP, NLGEOM",
            "*STATIC",
            "*BOUNDARY",
            *conditions,
            "*NODE PRINT, NSET=ALL",
            "U",
            "*NODE PRINT, NSET=CONTACT, TOTALS=ONLY",
            "RF",
            "*END STEP",
            "",
        ]
    )


def cells(space: LagrangeSpace | ExtrudedSpace) -> IntArray:
    """Nodes of every element in CalculiX's order: corners of positive volume, then middles of the edges."""
    if isinstance(space, LagrangeSpace):
        return space.cell_nodes
    corners = space.vertices[space.cells]
    places = space.nodes[corners]
    inverted = np.linalg.det(places[:, 1:] - places[:, :1]) < 0
    corners[inverted] = corners[inverted][:, [1, 0, 2, 3]]
    return np.concatenate([corners, space.edge_nodes(corners[:, TETRAHEDRON])], axis=1)


CALCULIX = Case(name="CalculiX", answer="that of CalculiX", measure=calculix, needs=PROGRAM)
