"""Derivatives of the figures: against solutions of the changed problem on the mesh that followed it."""

import numpy as np
import pytest

import pinnray as pr
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.svg import section_svg
from pinnray.geometry.mesh.design_motion import MovingMesh
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.solvers.fem.linear import FemSolver
from pinnray.solvers.finger_figures import figures_of
from pinnray.solvers.finger_figures.sensitivity import _parameters, sensitivity_of
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.registry import make_solver
from tests.solvers.conftest import SHORT

pytestmark = pytest.mark.usefixtures("few_elements_throughout")

CHECKED = ("force", "tip_u", "tip_v", "wrap", "von_mises", "principal_strain", "compliance_across", "mass")


@pytest.fixture(scope="module")
def mesh() -> TriangleMesh:
    """`SHORT` with one element across its walls: the derivatives are those of any mesh."""
    return finger_mesh(SHORT, settings=MeshSettings(size=2.0), across=1)


def solved(problem: Problem) -> dict[str, float]:
    linear = problem.material.law == "linear"
    solver = FemSolver(estimate=False) if linear else make_solver("fem-nonlinear", tolerance=1e-10)
    return figures_of(solver.solve(problem)).values()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "load", "names"),
    [
        ("linear", Load(stroke=4.0), ("height", "poisson")),
        pytest.param(
            *("neo-hookean", Load("patch", stroke=4.0, direction=10.0)),
            ("front_thickness", "contact_position"),
            marks=pytest.mark.slow,
        ),
        ("neo-hookean", Load("cylinder", stroke=4.0, radius=6.0), ("back_thickness", "radius")),
    ],
    ids=["linear", "patch", "cylinder"],
)
def test_the_derivatives_are_those_of_solved_problems(monkeypatch, mesh, law, load, names):
    """Followed from rest, with steps twice as long and a tolerance of a hundredth."""
    problem = Problem(mesh, Material(law=law), load, None, SHORT)
    found = sensitivity_of(problem)
    monkeypatch.setattr("pinnray.solvers.finger_figures.sensitivity.STEP", 2e-2)
    chosen = [each for each in _parameters(problem) if each.name in names]
    assert len(chosen) == len(names)
    for each in chosen:
        low, high = solved(each.low), solved(each.high)
        for name in CHECKED:
            difference = (high[name] - low[name]) / (2 * each.step)
            largest = max(abs(slope) for slope in found.derivatives[name].values())
            own = found.derivatives[name][each.name]
            assert own == pytest.approx(difference, rel=2e-3, abs=2e-3 * largest), (name, each.name)


def test_figures_in_proportion_have_shares_of_one(mesh):
    found = sensitivity_of(Problem(mesh, Material(), Load(stroke=4.0), None, SHORT))
    force, compliance = found.relative("force"), found.relative("compliance_across")
    assert [force[name] for name in ("young", "depth", "stroke")] == pytest.approx([1, 1, 1], abs=2e-4)
    assert compliance["young"] == pytest.approx(-1, abs=2e-4)
    assert np.isnan(force["direction"])  # zero degrees have no percent
    assert "fillet_radius" not in force
    stiffer = 0.2 * found.figures.force
    assert found.tolerance("force", wall_error=0.0, young_error=0.2) == pytest.approx(stiffer, rel=2e-4)
    both = found.tolerance("force", wall_error=0.1, young_error=0.2)
    walls = found.tolerance("force", wall_error=0.1, young_error=0.0)
    assert both == pytest.approx(np.hypot(walls, stiffer))
    assert found.table().loc["young", "force"] == pytest.approx(found.figures.force / 11.4)
    assert found.plot("wrap")._repr_png_()[:8] == b"\x89PNG\r\n\x1a\n"
    with pytest.raises(pr.UserError, match="there is no figure 'forse'; there are force"):
        found.relative("forse")


@pytest.mark.slow
def test_a_drawn_finger_has_its_walls(tmp_path):
    """They become thicker into the cavities; by how much the force changes is nearly that of the design."""
    design = pr.load_design("default")
    file = tmp_path / "drawn.svg"
    file.write_text(section_svg(design))
    drawn = pr.sensitivity(file, size=1.0, stroke=4.0)
    designed = pr.sensitivity(design, size=1.0, stroke=4.0)
    for name in ("rib_thickness", "front_thickness", "back_thickness"):
        own, other = (found.derivatives["force"][name] for found in (drawn, designed))
        assert own == pytest.approx(other, rel=0.1), name
        assert drawn.derivatives["mass"][name] > 0
    assert drawn.tolerance("force") == pytest.approx(designed.tolerance("force"), rel=0.05)
    assert "height" not in drawn.values


def test_the_mesh_follows_every_parameter_of_its_section(short_mesh):
    """Its area stays that of the section, arcs too: a node keeps its place on its piece."""
    design = SHORT.replaced(tip_radius=2.0, fillet_radius=0.5)
    mesh = finger_mesh(design, settings=MeshSettings(size=1.0))
    other = design.replaced(rib_thickness=2.1, fillet_radius=0.6, height=50.5, contact_position=20.3)
    moved = MovingMesh(mesh, design).of(other)
    assert moved is not None
    chords = mesh.areas.sum() - design.section.area  # straight edges on arcs
    assert moved.areas.sum() - other.section.area == pytest.approx(chords, abs=0.2 * abs(chords))
    assert moved.points[moved.contact_node] == pytest.approx([20.3, 0.0], abs=1e-9)
    assert MovingMesh(mesh, design).of(design.replaced(fillet_radius=0.0)) is None
    with pytest.raises(pr.UserError, match="the mesh is not of the finger"):
        MovingMesh(short_mesh, design)
