"""A rigid cylinder pressed on a block, against Hertz's solution.

Source: K. L. Johnson, Contact Mechanics, Cambridge University Press, 1985, section 4.2(c).
"""

import numpy as np

from benchmarks.verification.meshes import mapped_mesh
from benchmarks.verification.record import Case, Row, about, at_most
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.problem import Load, Material, Problem

WIDTH, DEPTH = 60.0, 30.0
MATERIAL = Material(poisson=0.3, law="neo-hookean")
RADIUS, INDENTATION = 20.0, 0.035
FINEST = 0.05
"""Elements under the cylinder, mm."""


def hertz() -> tuple[Row, ...]:
    """Half-width, peak pressure and stress over those of Hertz for the same force."""
    load = Load(kind="cylinder", radius=RADIUS, displacement=(0.0, -INDENTATION))
    solution = FemNonlinearSolver().solve(Problem(block(), MATERIAL, load))
    force, modulus = -solution.reaction[1], MATERIAL.young / (1 - MATERIAL.poisson**2)
    half_width = np.sqrt(4 * force * RADIUS / (np.pi * modulus))
    peak = 2 * force / (np.pi * half_width)
    width = float(solution.stats["contact_width_mm"]) / 2 / half_width
    pressure = float(solution.stats["contact_pressure_MPa"]) / peak
    x = np.linspace(-0.85, 0.85, 41)
    below = np.column_stack([0.5 * WIDTH + half_width * x, np.full(len(x), -1e-6)])
    stress = solution.state(below).stress[:, 1, 1] / peak
    away = float(np.abs(stress + np.sqrt(1 - x**2)).max())
    return (
        Row("half-width / that of Hertz", width, about(1, 0.5 * FINEST / half_width)),
        Row("peak pressure / that of Hertz", pressure, about(1, 0.015)),
        Row("stress less Hertz's ellipse / peak pressure", away, at_most(0.03)),
    )


def block() -> TriangleMesh:
    """A block clamped below, fine under the middle of its top."""
    side, down = graded(0.8, 0.5 * WIDTH), graded(0.4, DEPTH)
    across = np.concatenate([-side[:0:-1], side]) + 0.5 * WIDTH
    up = -down[::-1]

    def mapping(square: FloatArray) -> FloatArray:
        steps = [np.linspace(0, 1, len(positions)) for positions in (across, up)]
        return np.column_stack(
            [np.interp(square[:, 0], steps[0], across), np.interp(square[:, 1], steps[1], up)]
        )

    return mapped_mesh(mapping, len(across) - 1, len(up) - 1)


def graded(fine_until: float, end: float, growth: float = 1.35) -> FloatArray:
    """Positions from 0 to `end`, mm, in steps that are the finest up to `fine_until` and grow beyond."""
    positions, step = list(np.arange(0, fine_until + FINEST / 2, FINEST)), FINEST
    while positions[-1] < end:
        step *= growth
        positions.append(positions[-1] + step)
    return np.array(positions) * end / positions[-1]


HERTZ = Case(name="rigid cylinder", answer="closed form for small strain", measure=hertz)
