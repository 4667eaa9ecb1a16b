"""The default finger on a coarse mesh, its model, and a twin of it that was identified."""

from dataclasses import replace

import pytest

from pinnray.solvers.problem import Load, Material, Problem
from tests.solvers.identification.twins import TRUE, marked, model_of, sought, twin


@pytest.fixture(scope="session")
def problem(coarse_mesh):
    return Problem(coarse_mesh, Material(law="neo-hookean"), Load(displacement=(None, -6.0)))


@pytest.fixture(scope="session")
def fine_problem(problem, usual_mesh):
    return replace(problem, mesh=usual_mesh)


@pytest.fixture(scope="session")
def model(fine_problem):
    return model_of(fine_problem)


@pytest.fixture(scope="session")
def markers(model):
    return marked(model)


@pytest.fixture(scope="session")
def identified(problem):
    """A twin of the neo-Hookean law, and what is found from its markers with noise."""
    observed, true = twin(problem, "neo-hookean", TRUE)
    return observed, true, sought(problem, observed)
