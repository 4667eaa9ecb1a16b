"""The frame of beams against closed forms and against finite elements."""

import csv

import numpy as np
import pytest

from pinnray.geometry.finger.parameters import Parameters
from pinnray.solvers.problem import Material
from pinnray.studies.emulator.frame import SHEAR_SHARE, BeamFrame, _deformations, _stiffness
from pinnray.studies.sweep.sampling import samples
from pinnray.studies.sweep.study import Study
from tests.studies.emulator.sweeps import DATA

TRAVEL = (0.0, -10.0)


def beam(length: float, rigid: tuple[float, float], thickness: float, material: Material) -> np.ndarray:
    """Stiffness of a beam along x, shape (6, 6)."""
    elastic = np.array(length - sum(rigid))
    modes = _deformations(np.array([1.0, 0.0]), elastic, np.array(rigid))
    return modes.T @ _stiffness(elastic, np.array(thickness), material) @ modes


def test_a_cantilever_bends_and_shears_as_timoshenko_says() -> None:
    length, thickness, material = 7.0, 1.5, Material(poisson=0.3)
    modulus, shear = 1 / (1 - 0.3**2), 1 / (2 * 1.3)
    local = beam(length, (0.0, 0.0), thickness, material)
    moved = np.linalg.solve(local[3:, 3:], [0.0, 1.0, 0.0])
    bending = length**3 / (3 * modulus * thickness**3 / 12)
    assert moved[1] == pytest.approx(bending + length / (SHEAR_SHARE * shear * thickness), rel=1e-12)
    assert moved[2] == pytest.approx(length**2 / (2 * modulus * thickness**3 / 12), rel=1e-12)


def test_rigid_ends_shorten_a_cantilever() -> None:
    material = Material(poisson=0.3)
    stiff, short = beam(7.0, (1.0, 0.0), 1.5, material), beam(6.0, (0.0, 0.0), 1.5, material)
    assert stiff[3:, 3:] == pytest.approx(short[3:, 3:], rel=1e-12)


def test_a_beam_that_moves_as_a_rigid_body_has_no_force() -> None:
    local = beam(7.0, (0.4, 0.9), 1.5, Material())
    assert local @ [0, -3.0, 1.0, 0, 4.0, 1.0] == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("ribs", [0, 1, 4])
def test_a_finger_twice_as_large_is_as_stiff(ribs: int) -> None:
    lengths = ("height", "base_width", "tip_length", "rib_thickness", "front_thickness", "back_thickness")
    small = Parameters(rib_count=ribs)
    twice = {name: 2 * getattr(small, name) for name in (*lengths, "base_thickness", "contact_width")}
    one, other = (
        BeamFrame.of([each]).response(Material(), TRAVEL) for each in (small, small.model_copy(update=twice))
    )
    assert other.force == pytest.approx(one.force, rel=1e-9)
    assert other.compliance == pytest.approx(one.compliance, rel=1e-9)
    assert other.tip == pytest.approx(one.tip, rel=1e-9)


def test_a_contact_that_slides_has_no_force_along_the_finger() -> None:
    frame = BeamFrame.of([Parameters()])
    free = frame.response(Material(), (None, -10.0))
    assert free.force == pytest.approx(10 / free.compliance[:, 1])
    assert (frame.response(Material(), TRAVEL).force > free.force).all()


def test_it_follows_finite_elements() -> None:
    study = Study.load(DATA / "ref.toml")
    every = samples(study)
    with (DATA / "ref.csv").open(encoding="utf-8") as table:
        rows = [row for row in csv.DictReader(table) if every[int(row["sample"])]["rib_count"] == 4]
    shapes = [Parameters(**every[int(row["sample"])]) for row in rows]
    ratio = np.log(11.4 * 20 * BeamFrame.of(shapes).response(Material(), TRAVEL).force)
    ratio -= np.log([float(row["force"]) for row in rows])
    assert abs(ratio.mean()) < 0.25
    assert ratio.std() < 0.04  # the forces themselves vary by 0.7
