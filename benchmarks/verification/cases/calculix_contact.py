"""The default finger under a cylinder, without and with friction, against CalculiX.

Source: CalculiX CrunchiX 2.20 by G. Dhondt and K. Wittig, Debian's package calculix-ccx.
"""

import numpy as np

from benchmarks.verification.cases.calculix import PROGRAM, Answer, cells, solved
from benchmarks.verification.record import Case, Row, at_most
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.contact.nodal_contact import CylinderContact
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.solvers.problem import Load, Material, Problem

RADIUS, TRAVEL = 10.0, 3.0
"""Of the cylinder, mm."""
FRICTIONS = (0.0, 0.5)
PENALTY = 1e4
"""Pressure over overlap, and friction over slip, MPa/mm: a pressure of 0.3 MPa overlaps by 3e-5 mm."""
HALF, ARCS, RING = np.radians(40.0), 160, 1.0
"""The cylinder's mesh: half of its arc, elements along it, and its thickness, mm."""


def calculix_contact() -> tuple[Row, ...]:
    """Differences of displacement and force."""
    mesh = finger_mesh(Design(), settings=MeshSettings(size=1.0))
    rows = []
    for friction in FRICTIONS:
        load = Load(kind="cylinder", radius=RADIUS, displacement=(0.0, -TRAVEL), friction=friction)
        problem = Problem(mesh, Material(law="st-venant-kirchhoff"), load)
        ours, space = FemNonlinearSolver().solve(problem), LagrangeSpace(mesh, 2)
        theirs = answer(problem, space)
        count, size = len(space.nodes), np.linalg.norm(ours.reaction)
        away = ours.displacement(space.nodes) - theirs.displacement[:count]
        force = np.linalg.norm(ours.reaction + theirs.force) / size  # theirs is that of the clamp
        largest = np.abs(theirs.displacement[:count]).max()
        for what, difference, bound in (
            ("displacement", np.abs(away).max() / largest, 2e-3),
            ("force", force, 0.02),
        ):
            row = f"difference of the {what}, friction {friction:g}"
            rows.append(Row(row, float(difference), at_most(bound)))
    return tuple(rows)


def answer(problem: Problem, space: LagrangeSpace) -> Answer:
    """CalculiX's displacements, the cylinder's nodes last, and the force on the clamp."""
    ring = cylinder(CylinderContact.of(problem, space).centre)
    return solved(deck(problem, space, ring), len(space.nodes) + len(ring), 2)


def cylinder(centre: FloatArray) -> FloatArray:
    """Nodes of the ring: on its outer, inner and middle arc, shape (3 (2 ARCS + 1), 2), mm."""
    angles = np.linspace(-HALF, HALF, 2 * ARCS + 1) - np.pi / 2
    arc = np.column_stack([np.cos(angles), np.sin(angles)])
    return np.concatenate([centre + radius * arc for radius in (RADIUS, RADIUS - RING, RADIUS - RING / 2)])


def deck(problem: Problem, space: LagrangeSpace, ring: FloatArray) -> str:
    """Input of `ccx`: the finger in CPE6, the cylinder in CPE8 elements whose nodes are all moved."""
    body, count = cells(space), len(space.nodes)
    front = {tuple(sorted(edge)) for edge in problem.mesh.boundary("front").tolist()}
    slaves = [
        (number, side)
        for number, cell in enumerate(body, 1)
        for side, ends in enumerate(((0, 1), (1, 2), (2, 0)), 1)
        if tuple(sorted(int(cell[end]) for end in ends)) in front
    ]
    outer, inner, middle = (count + 1 + part * (2 * ARCS + 1) for part in range(3))
    last, ring_cells = len(body), []
    for arc in range(ARCS):
        left, between, right = 2 * arc, 2 * arc + 1, 2 * arc + 2
        corners = [outer + left, outer + right, inner + right, inner + left]
        ring_cells.append([*corners, outer + between, middle + right, inner + between, middle + left])
    friction = [] if not problem.load.friction else ["*FRICTION", f"{problem.load.friction:g},{PENALTY:g}"]
    return "\n".join(
        [
            "*NODE, NSET=ALL",
            *(
                f"{number},{x:.12g},{y:.12g},0"
                for number, (x, y) in enumerate(np.concatenate([space.nodes, ring]).tolist(), 1)
            ),
            "*ELEMENT, TYPE=CPE6, ELSET=BODY",
            *(",".join(map(str, [number, *(nodes + 1)])) for number, nodes in enumerate(body, 1)),
            "*ELEMENT, TYPE=CPE8, ELSET=RIGID",
            *(",".join(map(str, [last + number, *nodes])) for number, nodes in enumerate(ring_cells, 1)),
            "*NSET, NSET=CYLINDER",
            *(str(count + number) for number in range(1, len(ring) + 1)),
            "*NSET, NSET=BASE",
            *(str(node + 1) for node in space.boundary_nodes("base")),
            "*SURFACE, NAME=SLAVE",
            *(f"{number},S{side}" for number, side in slaves),
            "*SURFACE, NAME=MASTER",
            *(f"{last + number},S1" for number in range(1, ARCS + 1)),
            "*MATERIAL, NAME=RUBBER",
            "*ELASTIC",
            f"{problem.material.young:.12g},{problem.material.poisson:.12g}",
            *("*SOLID SECTION, ELSET=BODY, MATERIAL=RUBBER", "1."),
            *("*SOLID SECTION, ELSET=RIGID, MATERIAL=RUBBER", "1."),
            "*SURFACE INTERACTION, NAME=TOUCH",
            "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR",
            f"{PENALTY:g}",
            *friction,
            "*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE",
            "SLAVE,MASTER",
            "*STEP, NLGEOM, INC=1000",
            *("*STATIC", "0.1,1.,1e-6,0.1"),
            *("*BOUNDARY", "BASE,1,2", "CYLINDER,1,1", f"CYLINDER,2,2,{-TRAVEL:g}"),
            *("*NODE PRINT, NSET=ALL, FREQUENCY=1000", "U"),
            *("*NODE PRINT, NSET=BASE, TOTALS=ONLY, FREQUENCY=1000", "RF"),
            "*END STEP",
            "",
        ]
    )


CALCULIX_CONTACT = Case(
    name="CalculiX in contact", answer="that of CalculiX", measure=calculix_contact, needs=PROGRAM
)
