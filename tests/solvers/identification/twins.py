"""Twin experiments: markers of a finger whose values are known."""

from dataclasses import replace

import numpy as np

from pinnray.solvers.fem.identification import FemBody, FemIdSolver
from pinnray.solvers.identification.model import EXACT, MarkerData, MarkerModel, ResponseModel
from pinnray.solvers.identification.unknowns import DEFAULT, Unknowns
from tests.solvers.conftest import observed_at

NOISE = 0.01
NAMES = (*(name for name in DEFAULT if name != "feet"), "young")
VALUES = {
    "position": 36.3,
    "width": 5.0,
    "normal_force": 0.16,
    "shear_force": 0.02,
    "eccentricity": 0.4,
    "front_thickness": 2.1,
    "back_thickness": 1.92,
    "rib_thickness": 2.05,
    "base_thickness": 2.4,
    "base_compliance": 0.5,
    "poisson": 0.43,
    "young": 10.0,
}


def model_of(problem, names=NAMES):
    unknowns = Unknowns(problem, names)
    return ResponseModel(FemBody(unknowns, 1), unknowns)


def marked(model):
    """The default finger's markers in a model."""
    observed = observed_at(model.unknowns.problem.mesh.markers, np.zeros((9, 2)), NOISE)
    return MarkerModel(model, MarkerData.of(model.unknowns.problem, observed, None))


def contact_of(model, response):
    """Mean displacement of the contact, shape (2,), mm."""
    there, front = response.hypothesis, model.unknowns.traction
    rows = model.body.traction_rows(front.points, front.weights(there.position, there.width))
    return np.tensordot(rows[0], response.state, axes=response.state.ndim)


def values_of(unknowns, changed=VALUES):
    drawn = {parameter.name: parameter.start for parameter in unknowns.parameters(1.0)}
    return np.array([(drawn | changed)[name] for name in unknowns.names])


def twin(problem, law, values, *, noise=NOISE, seed=0):
    """Observations of a finger that has such values, and its force, N/mm."""
    own = replace(problem, material=problem.material.model_copy(update={"law": law}))
    model = model_of(own, DEFAULT)
    response = model.response(values_of(model.unknowns, values), EXACT)
    assert response is not None
    moved = marked(model).predicted(response)[0].reshape(-1, 2)
    moved = moved + noise * np.random.default_rng(seed).normal(size=moved.shape)
    return observed_at(problem.mesh.markers, moved, NOISE), response


def sought(problem, observed, **settings):
    """What `fem-id` with linear elements finds from observations."""
    return FemIdSolver(degree=1, **settings).solve(replace(problem, observations=observed))


TRUE = {"position": 37.5, "normal_force": 0.18, "shear_force": -0.02, "rib_thickness": 2.08}
