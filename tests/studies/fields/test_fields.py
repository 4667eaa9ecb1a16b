"""Emulated fields against fields in closed form, and kept fields against a solution on its own mesh."""

import json
import pickle
from dataclasses import replace

import numpy as np
import pytest

from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.presets import load_design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.solvers.fem.finite_strain.solver import FemNonlinearSolver
from pinnray.solvers.finger_figures import figures_of
from pinnray.solvers.finger_figures.measures import wrap_angle
from pinnray.solvers.lagrange import LagrangeField
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.studies.fields.emulator import FieldEmulator, fitted_fields, places
from pinnray.studies.fields.reader import FieldReader
from pinnray.studies.fields.store import fields_of
from pinnray.studies.sweep.field_path import FieldPath, moving_mesh
from pinnray.studies.sweep.job import StudyJob
from pinnray.studies.sweep.sampling import samples
from pinnray.studies.sweep.study import Study
from pinnray.studies.sweep.sweep import run_sweep
from tests.studies.fields.synthetic import STROKES, field, known, numbers, snapshots, study


@pytest.fixture(scope="module")
def emulator() -> FieldEmulator:
    return fitted_fields(snapshots(study()))


def test_unseen_fields_are_predicted_between_samples_and_between_strokes(emulator):
    inside = []
    for sample in samples(study(count=40, seed=7)):
        for share in (0.07, 0.37, 0.9):
            found = emulator.predict(sample, share * emulator.stroke)
            true = field(found.solution().field.space, sample, share)
            off = np.sqrt(((found.nodal - true) ** 2).sum() / (true**2).sum())
            assert off < 0.003  # the spline of five strokes and modes of a share 1e-6 leave less
            inside.append(off <= found.error)
            force = -numbers(sample, share)[1] * 20
            assert found.figures["force"] == pytest.approx(force, rel=0.01)
    assert np.mean(inside) > 0.85


def test_force_and_stress_grow_with_youngs_modulus_and_depth():
    varied = {
        "radius": {"from": 4, "to": 16},
        "young": {"from": 2, "to": 20},
        "depth": {"from": 10, "to": 30},
    }
    given = study(varied, 30)
    shots = snapshots(given)
    scaled = shots.numbers * np.where(np.arange(5) < 3, shots.factors[:, None, None], 1.0)
    emulator = fitted_fields(replace(shots, numbers=scaled))
    soft, hard = (
        emulator.predict({"radius": 8.0, "young": young, "depth": depth}, 6.0)
        for young, depth in ((4.0, 10.0), (8.0, 30.0))
    )
    assert hard.figures["force"] == pytest.approx(6 * soft.figures["force"], rel=1e-9)
    assert hard.figures["von_mises"] == pytest.approx(2 * soft.figures["von_mises"], rel=1e-9)
    widths = [np.ptp(each.intervals["force"]) for each in (soft, hard)]
    assert widths[1] == pytest.approx(6 * widths[0], rel=1e-9)


def test_a_field_outside_the_study_is_refused_with_the_reason(emulator):
    inside = {"contact_position": 45.0, "radius": 10.0}
    assert emulator.fault(inside, 5.0) is None
    assert "outside the sweep" in str(emulator.fault({**inside, "radius": 17.0}, 5.0))
    assert "stroke = 11" in str(emulator.fault(inside, 11.0))
    missing = replace(emulator, lost=places(emulator.inputs, [inside]), reasons=["it buckles"])
    assert "it buckles" in str(missing.fault(inside, 5.0))


def test_an_emulator_is_kept_whole(emulator):
    again = pickle.loads(pickle.dumps(emulator))
    sample = {"contact_position": 40.0, "radius": 9.0}
    first, second = (each.predict(sample, 7.0) for each in (emulator, again))
    assert np.array_equal(first.nodal, second.nodal)
    assert (first.figures, first.intervals, first.error) == (second.figures, second.intervals, second.error)


CHANGED = {
    "nothing": lambda patch, now: now,
    "another sample is lost": lambda patch, now: replace(now, lost=[{**now.lost[0], "radius": 15.0}]),
    "a sample was lost for another reason": lambda patch, now: replace(now, reasons=["refused"]),
    "samples of other values": lambda patch, now: replace(now, samples=now.samples[::-1]),
    "another version of a library": lambda patch, now: (
        patch.setattr("pinnray.studies.emulator.store.package_versions", lambda: {"scipy": "9"}),
        now,
    )[1],
}


@pytest.mark.parametrize("what", CHANGED)
def test_an_emulator_is_kept_for_what_it_was_fitted_to(what, emulator, tmp_path, monkeypatch):
    now = known(study(), [{"contact_position": 59.0, "radius": 4.5}])
    fitted = []
    monkeypatch.setenv("PINNRAY_CACHE", str(tmp_path))
    monkeypatch.setattr("pinnray.studies.fields.store.KnownSamples.of", lambda folder: now)
    monkeypatch.setattr("pinnray.studies.fields.store.Snapshots.load", lambda known: known)
    monkeypatch.setattr(
        "pinnray.studies.fields.store.fitted_fields", lambda known, stages: fitted.append(known) or emulator
    )
    fields_of(tmp_path)
    now = CHANGED[what](monkeypatch, now)
    fields_of(tmp_path)
    assert len(fitted) == (1 if what == "nothing" else 2)


@pytest.mark.slow
def test_the_reader_reads_what_the_figures_of_a_solution_say():
    finger = load_design("default")
    meshes = moving_mesh(json.dumps(finger.definition()), MeshSettings(size=5.0))
    load = Load("cylinder", stroke=4.0, radius=8.0, position=40.0)
    problem = Problem(meshes.mesh, Material(law="neo-hookean"), load, finger=finger)
    solution = FemNonlinearSolver().solve(problem)
    assert isinstance(solution.field, LagrangeField)
    figures, reader = figures_of(solution, {}), FieldReader(meshes.mesh)
    points, nodal = meshes.mesh.points, solution.field.values
    stress = reader.stress(points, nodal, "neo-hookean", problem.material.lame)
    tip_u, tip_v, wrap, largest = reader.figures(points, nodal, stress, 40.0)
    assert (tip_u, tip_v) == pytest.approx((figures.tip_u, figures.tip_v), abs=1e-9)
    assert wrap == pytest.approx(wrap_angle(solution), abs=1e-3)  # the contact's middle is interpolated
    assert largest == pytest.approx(figures.von_mises, rel=1e-9)


@pytest.mark.slow
def test_a_sweep_keeps_the_path_of_each_sample_on_the_moved_mesh(tmp_path, in_line, few_elements):
    given = Study(
        name="kept",
        solver="fem-nonlinear",
        mesh_size=5.0,
        samples=2,
        strokes=2,
        fixed={"load": "cylinder", "stroke": 3.0},
        varied={"front_thickness": {"from": 1.5, "to": 2.5}, "contact_position": {"from": 40, "to": 50}},
    )
    job = StudyJob(given, tmp_path, tmp_path / "out")
    done = run_sweep(job)
    assert [each.state for each in done.measurements] == ["done", "done"]
    task = job.task(1, done.samples[1])
    assert task.fields is not None
    path = FieldPath.load(task.fields.file)
    finger = Design(**task.definition)
    middle = load_design("default").replaced(front_thickness=2.0, contact_position=45.0)
    mesh = moving_mesh(json.dumps(middle.definition()), MeshSettings(size=5.0)).of(finger)
    for number, stroke in enumerate((1.5, 3.0)):
        load = Load("cylinder", stroke=stroke, radius=5.0, position=finger.contact_abscissa)
        solution = FemNonlinearSolver().solve(Problem(mesh, Material(law="neo-hookean"), load, finger=finger))
        assert isinstance(solution.field, LagrangeField)
        assert path.nodal[number] == pytest.approx(solution.field.values, abs=1e-4)  # the contact's tolerance
        assert path.numbers[number, :2] == pytest.approx(
            solution.reaction, abs=1e-3 * abs(solution.reaction[1])
        )


def test_a_path_between_its_equilibria_is_a_spline():
    assert STROKES == 5  # the shares below
    shares = np.array([0, 0.2, 0.45, 0.6, 0.8, 1.0])
    from types import SimpleNamespace

    states = [LagrangeField(None, np.full((3, 2), share + share**3)) for share in shares]
    history = {"load_fraction": shares, "reaction_x": shares, "reaction_y": shares, "energy": shares}
    path = FieldPath.of(SimpleNamespace(history=history, states=states), STROKES)
    wanted = np.array([0.2, 0.4, 0.6, 0.8, 1.0])
    assert path.nodal[:, 0, 0] == pytest.approx(wanted + wanted**3, abs=1e-12)
