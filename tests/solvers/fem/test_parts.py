"""Bodies of several materials against closed forms; units mm, MPa."""

from dataclasses import replace

import numpy as np
import pytest

from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.load import Load
from pinnray.solvers.material import Material
from pinnray.solvers.problem import Problem
from tests.solvers.conftest import bar_mesh

SOFT, STIFF = (10.0, 0.3), (200.0, 0.3)


def bar(length: float, height: float, along: int, across: int) -> TriangleMesh:
    """A bar of straight layers, clamped at x = 0, with the contact on the last two elements of its top."""
    cell = np.array([length / along, height / across])
    mesh = bar_mesh(length, height, along, across, contact=(length - 2 * cell[0], length))
    return replace(mesh, points=np.round(mesh.points / cell) * cell)


def layered(mesh: TriangleMesh, height: float) -> TriangleMesh:
    """The upper half soft, by the problem's material, the lower one stiff."""
    lower = mesh.at_centroids().points[:, 1] < -height / 2
    return replace(mesh, moduli=np.where(lower[:, None], STIFF, 0.0))


def plane(young: float, poisson: float) -> float:
    return young / (1 - poisson**2)


def test_a_cantilever_of_two_layers_bends_as_composite_beams_do():
    length, height = 200.0, 4.0
    mesh = layered(bar(length, height, 100, 8), height)
    load = Load(kind="mean", displacement=(None, -1.0))
    problem = Problem(mesh, Material(young=SOFT[0], poisson=SOFT[1]), load)
    solution = FemSolver().solve(problem)
    soft, stiff, half = plane(*SOFT), plane(*STIFF), height / 2
    neutral = (soft * -half / 2 + stiff * -1.5 * half) / (soft + stiff)
    bending = sum(
        each * (half**3 / 12 + half * (middle - neutral) ** 2)
        for each, middle in ((soft, -half / 2), (stiff, -1.5 * half))
    )
    arm = length - 2.0  # the middle of the contact
    assert solution.reaction[1] == pytest.approx(-3 * bending / arm**3, rel=5e-3)
    # The stress jumps at the interface as the moduli do, at equal strain.
    above, below = solution.state(np.array([[60.0, -half + 1e-6], [60.0, -half - 1e-6]])).stress[:, 0, 0]
    assert below / above == pytest.approx(stiff / soft, rel=2e-2)
    moment = -solution.reaction[1] * (arm - 60.0)
    assert above == pytest.approx(soft * moment / bending * (-half - neutral), rel=2e-2)


@pytest.mark.parametrize("law", ["linear", "neo-hookean", "st-venant-kirchhoff"])
def test_a_sandwich_stretches_by_the_mean_of_its_plane_moduli(law):
    """Voigt's mean: layers side by side have one strain, so that half of the height counts for each."""
    length, height = 100.0, 2.0
    mesh = bar(length, height, 100, 8)
    skins = np.abs(mesh.at_centroids().points[:, 1] + height / 2) > height / 4
    mesh = replace(mesh, moduli=np.where(skins[:, None], STIFF, 0.0))
    load = Load(kind="patch", displacement=(1e-4, 0.0))
    solver = FemSolver() if law == "linear" else FemNonlinearSolver()
    solution = solver.solve(Problem(mesh, Material(young=SOFT[0], poisson=SOFT[1], law=law), load))
    strain = solution.gradient(np.array([[50.0, -0.2], [50.0, -1.0], [50.0, -1.8]]))[:, 0, 0]
    mean = 0.5 * (plane(*SOFT) + plane(*STIFF))
    assert strain[1] == pytest.approx(strain.mean(), rel=1e-3)  # the patch bends it a little
    assert solution.reaction[0] == pytest.approx(mean * height * strain.mean(), rel=1e-3)


def test_moduli_are_a_part_of_the_mesh(coarse_mesh, tmp_path):
    parted = replace(coarse_mesh, moduli=np.tile(STIFF, (len(coarse_mesh.triangles), 1)))
    assert parted.digest != coarse_mesh.digest
    parted.save(tmp_path / "mesh.npz")
    np.testing.assert_array_equal(TriangleMesh.load(tmp_path / "mesh.npz").moduli, parted.moduli)
