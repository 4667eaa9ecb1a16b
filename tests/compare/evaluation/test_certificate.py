"""The certificate against identities of linear algebra that hold for any displacement, and its verdict."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import skfem
from scipy.sparse import csr_matrix
from skfem.models.elasticity import linear_elasticity

from pinnray.comparison.evaluation.certifier import Certifier, with_certificates
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.solvers.fem.boundary_conditions import DisplacementConstraints
from pinnray.solvers.fem.equilibrium import DiscreteEquilibrium
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.lagrange import LagrangeField, LagrangeSpace
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.solution import Solution
from tests.compare.conftest import closed_form

pytestmark = pytest.mark.usefixtures("few_elements_throughout")

LOADS = {
    "mean": Load(),
    "point": Load(kind="point"),
    "patch": Load(kind="patch"),
    "sliding patch": Load(kind="patch", displacement=(None, -10.0)),
    "v only": Load(displacement=(None, -10.0)),
}


@pytest.fixture(scope="module")
def finger() -> TriangleMesh:
    return finger_mesh(Design(), settings=MeshSettings(size=1.0))


@pytest.fixture(scope="module")
def solution(finger: TriangleMesh) -> Solution:
    """The solution of `fem` under the mean load."""
    return FemSolver().solve(Problem(finger))


def sampled(
    problem: Problem, nodal: FloatArray, energy: float = 1.0, reaction: Sequence[float] = (0.0, 0.0)
) -> Evaluation:
    """The evaluation of a quadratic finite-element displacement, which reports the energy and force given."""
    field = LagrangeField(LagrangeSpace(problem.mesh, 2), nodal)
    given = closed_form(problem.mesh, field, problem=problem, energy=energy, reaction=np.array(reaction))
    return Evaluation.of(given, problem.mesh)


def disturbed(problem: Problem, size: float, *, at_base: bool = False) -> FloatArray:
    """The solution of `fem` plus a random displacement of so many mm, at the base and the contact too."""
    field = FemSolver().solve(problem).field
    random = size * np.random.default_rng(3).uniform(-1, 1, field.values.shape)  # type: ignore[attr-defined]
    if not at_base:
        random[field.space.boundary_nodes("base")] = 0.0  # type: ignore[attr-defined]
    return field.values + random  # type: ignore[attr-defined]


@pytest.mark.parametrize("load", LOADS.values(), ids=LOADS)
def test_fem_itself_has_no_excess_and_nothing_out_of_balance(finger, load):
    problem = Problem(finger, load=load)
    (own,) = with_certificates([Evaluation.of(FemSolver().solve(problem), finger)], problem)
    certificate = own.certificate
    assert own.converged
    assert own.message == FemSolver().solve(problem).status.message
    assert not certificate.has_excess
    assert certificate.energy == pytest.approx(own.energy, rel=1e-12)
    for value in (certificate.rel_excess, certificate.rel_violation, certificate.weak_residual):
        assert 0 <= value < 1e-8
    assert certificate.imbalance < 1e-8
    assert np.nanmax([certificate.base, *certificate.load]) < 1e-10


@pytest.mark.slow
@pytest.mark.parametrize("load", LOADS.values(), ids=LOADS)
def test_energies_of_any_displacement_against_another_program(finger, load):
    """Pythagoras: excess and violation are the energy of the difference from `fem`, which scikit-fem has too.

    The excess is the energy above the least with the same values; the dual norm of the imbalance, where the
    displacement is in the space, is the norm of what is above it.
    """
    problem = Problem(finger, load=load)
    nodal = disturbed(problem, 1e-3, at_base=True)
    certificate = Certifier(problem).certificate(sampled(problem, nodal))
    stiffness, order = stiffness_of_scikit_fem(problem)

    def energy(values: FloatArray) -> float:
        vector = values[order[:, 0], order[:, 1]]
        return 0.5 * float(vector @ (stiffness @ vector))

    assert certificate.energy == pytest.approx(energy(nodal), rel=1e-9)
    difference = energy(nodal - FemSolver().solve(problem).field.values)  # type: ignore[attr-defined]
    assert certificate.excess + certificate.violation == pytest.approx(difference, rel=1e-6)
    assert min(certificate.excess, certificate.violation) > 1e-3 * difference
    assert certificate.weak_residual == pytest.approx(np.sqrt(certificate.rel_excess), rel=1e-6)


def stiffness_of_scikit_fem(problem: Problem, *, centroids_only: bool = False) -> tuple[csr_matrix, IntArray]:
    """Its stiffness matrix, exact or seen at one point a triangle, and our node and axis of each row."""
    mesh, lame = problem.mesh, problem.material.lame
    basis = skfem.Basis(
        skfem.MeshTri(mesh.points.T.copy(), mesh.triangles.T.copy()),
        skfem.ElementVector(skfem.ElementTriP2()),
        intorder=2,
        quadrature=(np.full((2, 1), 1 / 3), np.array([0.5])) if centroids_only else None,
    )
    number = {tuple(place): node for node, place in enumerate(np.round(LagrangeSpace(mesh, 2).nodes, 9))}
    order = np.zeros((basis.N, 2), dtype=int)
    for axis in range(2):
        dofs = np.concatenate([basis.nodal_dofs[axis], basis.facet_dofs[axis]])
        order[dofs, 0] = [number[tuple(np.round(basis.doflocs[:, dof], 9))] for dof in dofs]
        order[dofs, 1] = axis
    return skfem.asm(linear_elasticity(lame.λ, lame.μ), basis), order


@pytest.mark.parametrize("load", LOADS.values(), ids=LOADS)
def test_missed_conditions_are_told_in_mm(finger, load):
    """Everything moved by (0.02, -0.03) mm, base and contact included, which takes no energy."""
    problem = Problem(finger, load=load)
    solution = FemSolver().solve(problem)
    moved = solution.field.values + np.array([0.02, -0.03])  # type: ignore[attr-defined]
    reported = sampled(problem, moved, solution.energy, solution.reaction)
    certificate = Certifier(problem).certificate(reported)
    assert certificate.base == pytest.approx(np.hypot(0.02, 0.03))
    free = [value is None for value in load.displacement]
    np.testing.assert_allclose(certificate.load, np.where(free, np.nan, [0.02, 0.03]), rtol=1e-8)
    assert max(certificate.rel_excess, certificate.rel_violation) < 1e-12
    assert certificate.faults == []  # 0.04 mm of 10 mm


def test_half_the_stroke_is_no_excess_and_a_quarter_of_the_energy_in_violation(solution):
    problem = solution.problem
    certificate = Certifier(problem).certificate(sampled(problem, 0.5 * solution.field.values))
    assert certificate.rel_excess < 1e-12
    assert certificate.rel_violation == pytest.approx(0.25)
    assert "it misses the conditions by up to 5 mm (limit 0.2 mm)" in certificate.faults


@pytest.mark.parametrize("poisson", [0.3, 0.44])
def test_a_wrong_law_shows(finger, poisson):
    """The field of another Poisson's ratio is not in balance under the right law."""
    wrong = FemSolver().solve(Problem(finger, Material(poisson=poisson)))
    certificate = Certifier(Problem(finger)).certificate(Evaluation.of(wrong, finger))
    assert certificate.rel_excess > 1e-4
    assert bool(certificate.faults) is (poisson == 0.3)


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"energy": 1000.0}, "it reports an energy"),
        ({"reaction": -1.0}, "it reports a force"),
        ({"reaction": 1000.0}, "it reports a force"),
    ],
)
@pytest.mark.parametrize("load", [LOADS["mean"], LOADS["sliding patch"]], ids=["mean", "sliding patch"])
def test_a_wrong_energy_or_force_is_found_out(finger, load, changes, fault):
    """A factor of a thousand is that of a wrong unit."""
    problem = Problem(finger, load=load)
    solution = FemSolver().solve(problem)
    wrong = replace(solution, **{name: factor * getattr(solution, name) for name, factor in changes.items()})
    [right], [found] = (
        with_certificates([Evaluation.of(each, finger)], problem) for each in (solution, wrong)
    )
    assert (right.converged, found.converged) == (True, False)
    assert fault in found.message


def test_a_minimiser_whose_quadrature_is_too_coarse_is_found_out(finger):
    """Quadratic elements whose energy is seen at one point a triangle: blind to some of their modes."""
    problem = Problem(finger)
    space = LagrangeSpace(finger, 2)
    seen, order = stiffness_of_scikit_fem(problem, centroids_only=True)
    whole, _ = stiffness_of_scikit_fem(problem)
    functionals = DisplacementConstraints.of(problem, space).functionals[:, order[:, 0], order[:, 1]].T
    clamped = np.flatnonzero(np.isin(order[:, 0], space.boundary_nodes("base")))
    blind = seen + 1e-3 * whole  # for it to have a minimum
    influence = np.column_stack(
        [skfem.solve(*skfem.condense(blind, functional, D=clamped)) for functional in functionals.T]
    )
    dofs = influence @ np.linalg.solve(functionals.T @ influence, problem.load.values)
    nodal = np.zeros((len(space.nodes), 2))
    nodal[order[:, 0], order[:, 1]] = dofs
    certificate = Certifier(problem).certificate(sampled(problem, nodal, 0.5 * float(dofs @ (seen @ dofs))))
    assert certificate.misses_energy
    assert certificate.energy > 2 * certificate.fem_energy
    assert len(certificate.faults) == 3  # the third: it reports no force


def test_least_energy_does_not_judge_a_solver_that_was_given_the_markers(fem, finger):
    given = replace(fem, in_sample=True)
    assert with_certificates([given], Problem(finger)) == [given]


def test_only_the_linear_law_under_a_given_contact_is_certified(solution, finger):
    evaluation = Evaluation.of(solution, finger)
    other = replace(evaluation, law="neo-hookean")
    first, second = with_certificates([evaluation, other], solution.problem)
    assert first.certificate is not None
    assert second is other
    pressed = replace(solution.problem, load=Load(kind="cylinder", radius=5.0))
    [found] = with_certificates([evaluation], pressed)
    assert found is evaluation


def test_energy_below_the_least_is_a_fault_of_the_program(solution, finger, monkeypatch):
    evaluation, certifier = Evaluation.of(solution, finger), Certifier(solution.problem)
    least = DiscreteEquilibrium.minimiser

    def spoilt(*arguments):
        nodal, forces = least(*arguments)
        return 1.001 * nodal, forces

    monkeypatch.setattr(DiscreteEquilibrium, "minimiser", spoilt)
    with pytest.raises(RuntimeError, match="below the least"):
        certifier.certificate(evaluation)


def test_a_result_that_is_not_finite_is_not_converged(finger):
    problem = Problem(finger)
    nodal = np.full((len(LagrangeSpace(finger, 2).nodes), 2), np.nan)
    (lost,) = with_certificates([sampled(problem, nodal)], problem)
    assert not lost.converged
    assert lost.message == "a given displacement; its displacement or stress is not finite everywhere"
