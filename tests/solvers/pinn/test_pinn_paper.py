"""`pinn-std --preset paper`: the same training as the plain one, to rounding, and how a training ends."""

import numpy as np
import pytest

from solvers.pinn.paper.solver import PaperPinnSolver
from solvers.pinn.threading import torch_threads
from solvers.problem import Load, Material, Problem
from tests.solvers.conftest import bar_mesh
from tests.solvers.pinn.autograd_reference import PlainPinn

TINY = {"width": 8, "layers": 2, "base_points": 20, "precision": "double"}


@pytest.mark.slow
def test_first_200_epochs_are_those_of_the_plain_implementation():
    """To rounding; a wrong law, gate or weight shows in the first epoch.

    Adam lets rounding grow later: two plain runs part by 1e-13 in 300 epochs and by 2e-7 in 500.
    """
    problem = Problem(bar_mesh(24.0, 4.0, 12, 4, contact=(14.0, 18.0)))
    solver = PaperPinnSolver(epochs=200, precision="double", base_points=50, threads=1)
    history = solver.solve(problem).history
    plain = PlainPinn(problem, solver)
    with torch_threads(1):  # so small a problem is slower on two
        expected = np.array([plain.step() for _ in range(200)])
    ours = np.column_stack([history[name] for name in ("PDE", "BC", "total")])
    np.testing.assert_allclose(ours, expected, rtol=1e-11)


@pytest.mark.parametrize(
    ("settings", "material", "load"),
    [
        ({}, Material(), Load()),  # the default load
        ({}, Material(), Load(kind="point")),  # the paper's
        ({}, Material(plane="stress"), Load(displacement=(None, -10.0))),  # the printed law; u free
        ({"literal_gate": True, "bc_weight": 10.0}, Material(poisson=0.3), Load()),  # the printed network
    ],
)
def test_first_epochs_of_every_variant(coarse_mesh, settings, material, load):
    solver = PaperPinnSolver(**TINY, epochs=5, **settings)
    problem = Problem(coarse_mesh, material, load)
    history = solver.solve(problem).history
    plain = PlainPinn(problem, solver)
    for epoch in range(5):
        ours = [history[name][epoch] for name in ("PDE", "BC", "total")]
        np.testing.assert_allclose(ours, plain.step(), rtol=1e-10)
