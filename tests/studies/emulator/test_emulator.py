"""The emulator of a sweep: accuracy, intervals, refusals, and the file that keeps it."""

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import pinnray as pr
from pinnray.cli import main
from pinnray.geometry.finger.design import Design
from pinnray.runtime.errors import UserError
from pinnray.solvers.finger_figures import QUANTITIES, Quantity
from pinnray.solvers.finger_figures.measures import narrowest_gap, thinnest_wall
from pinnray.studies.emulator import store
from pinnray.studies.emulator.emulator import Emulator
from pinnray.studies.emulator.store import emulator_of
from pinnray.studies.sweep.sampling import samples
from pinnray.studies.sweep.store import JOURNAL, opened
from pinnray.studies.sweep.study import Study, Value
from tests.studies.emulator.sweeps import DATA, solved_sweep, synthetic_sweep

pytestmark = pytest.mark.slow

TRAINED = 200
"""Fingers of the kept table that the emulator learns from; the other 100 are unseen."""

FINGER: dict[str, Value] = {
    **{"height": 90.0, "base_width": 30.0, "rib_angle": 15.0, "tip_length": 20.0, "rib_count": 5},
    **{"rib_thickness": 1.7, "front_thickness": 1.5, "back_thickness": 2.0},
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return solved_sweep(tmp_path_factory.mktemp("sweep") / "ref", count=TRAINED, left_out=("wrap",))


@pytest.fixture(scope="module")
def emulator(folder: Path) -> Emulator:
    return emulator_of(folder)


@pytest.fixture(scope="module")
def unseen(emulator: Emulator) -> tuple[list[dict[str, Value]], dict[str, np.ndarray]]:
    every = samples(emulator.study)
    with (DATA / "ref.csv").open(encoding="utf-8") as table:
        rows = list(csv.DictReader(table))[TRAINED:]
    fingers = [every[int(row["sample"])] for row in rows]
    return fingers, {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def small_study(count: int = 50, **changes: Any) -> Study:
    return Study(
        name="small",
        samples=count,
        fixed=changes.pop("fixed", {}),
        varied={
            "rib_thickness": {"from": 1.0, "to": 2.5},
            "front_thickness": {"from": 1.0, "to": 2.0},
            **changes,
        },
    )


def smooth(sample: Mapping[str, Value]) -> dict[str, float]:
    rib, front = float(sample["rib_thickness"]), float(sample["front_thickness"])
    young = float(sample.get("young", 11.4))
    force = young * np.exp(0.3 * np.sin(2 * rib) + front)
    return {"force": force, "force_50": 0.5 * force, "tip_v": rib - front**2}


def test_forces_of_fingers_that_it_has_not_seen_are_predicted(emulator, unseen):
    fingers, truth = unseen
    found = emulator.predict(fingers)
    errors = np.abs(found["force"][0] / truth["force"] - 1)
    assert np.median(errors) < 0.005


def test_intervals_hold_for_most_fingers_that_it_has_not_seen(emulator, unseen):
    fingers, truth = unseen
    found = emulator.predict(fingers, ("force", "tip_v", "von_mises"))
    held = [(low <= truth[name]) & (truth[name] <= high) for name, (_, low, high) in found.items()]
    assert 0.9 <= np.mean(held) <= 0.995  # of 300, whose standard deviation is 0.013


def test_quantities_of_the_section_are_exact(emulator: Emulator) -> None:
    design = Design(**FINGER, marker_diameter=0.4)
    found = emulator.predict([FINGER])
    assert (found["area"] == design.section.area).all()
    assert found["mass"][0] == pytest.approx(design.section.area * 20 * 1.2 / 1000)
    assert found["thinnest_wall"][0] == thinnest_wall(design.section)
    assert found["narrowest_gap"][0] == narrowest_gap(design.section)


def test_a_quantity_of_which_the_frame_says_nothing_is_learnt_too(tmp_path, monkeypatch):
    """So that a new one is added in one file, the quantities'."""
    monkeypatch.setitem(QUANTITIES, "new", Quantity("mm", "of the test"))
    folder = synthetic_sweep(
        tmp_path / "out", small_study(), lambda one: smooth(one) | {"new": one["rib_thickness"] ** 2}
    )
    finger = {"rib_thickness": 1.6, "front_thickness": 1.4}
    assert emulator_of(folder).predict([finger])["new"][0] == pytest.approx(1.6**2, rel=1e-3)


def test_it_is_kept_to_the_bit(folder: Path, emulator: Emulator, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "fitted_emulator", pytest.fail)  # a second fit
    first, again = emulator.predict([FINGER]), emulator_of(folder).predict([FINGER])
    assert list(first) == list(again)
    assert all(np.array_equal(first[name], again[name]) for name in first)


def test_a_function_in_closed_form_is_learnt(tmp_path: Path) -> None:
    emulator = emulator_of(synthetic_sweep(tmp_path / "s", small_study(), smooth))
    unseen = samples(small_study(300))[100:]
    found = emulator.predict(unseen, ["force", "tip_v"])
    for name, (values, _, _) in found.items():
        truth = [smooth(sample)[name] for sample in unseen]
        assert np.median(np.abs(values / truth - 1)) == pytest.approx(0, abs=5e-3)


def test_youngs_modulus_is_a_factor(tmp_path: Path) -> None:
    study = small_study(young={"from": 5.0, "to": 20.0})
    emulator = emulator_of(synthetic_sweep(tmp_path / "s", study, smooth))
    finger = {"rib_thickness": 1.3, "front_thickness": 1.1}
    found = emulator.predict([{**finger, "young": 6.0}, {**finger, "young": 18.0}], ["force", "tip_v"])
    assert [found[name][0, 1] / found[name][0, 0] for name in found] == pytest.approx([3, 1], rel=1e-12)


def test_choices_are_learnt_apart(tmp_path: Path) -> None:
    def stiffer(sample: Mapping[str, Value]) -> dict[str, float]:
        factor = 3.0 if sample["rib_reference"] == "base" else 1.0
        return {"force": factor * smooth(sample)["force"]}

    study = small_study(rib_reference={"values": ["front", "base"]})
    emulator = emulator_of(synthetic_sweep(tmp_path / "s", study, stiffer))
    finger = {"rib_thickness": 1.3, "front_thickness": 1.1}
    found = emulator.predict([{**finger, "rib_reference": each} for each in ("front", "base")], ["force"])
    assert found["force"][0, 1] / found["force"][0, 0] == pytest.approx(3, rel=0.02)
    assert emulator.inputs.fault({**finger, "rib_reference": "tip"}) == (
        "rib_reference = tip is outside the sweep: one of front, base"
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"height": 120.0}, "height = 120 is outside the sweep: 80 to 110 mm"),
        ({"height": float("nan")}, "height = nan is outside the sweep"),
        ({"rib_count": 9}, "rib_count = 9 is outside the sweep: a whole number from 2 to 8"),
        ({"rib_count": 2.5}, "rib_count = 2.5 is outside the sweep: a whole number"),
        ({"depth": 20.0}, "depth is not varied in this sweep, which varies height, base_width"),
        ({"rib_count": 8, "rib_angle": -19.0}, "between base wall and first rib"),
    ],
)
def test_what_it_cannot_predict_is_told(emulator: Emulator, change: dict[str, Value], words: str) -> None:
    assert emulator.inputs.fault(FINGER) is None
    assert words in str(emulator.inputs.fault({**FINGER, **change}))


def test_more_samples_fit_it_again(tmp_path: Path) -> None:
    folder = solved_sweep(tmp_path / "s", count=30, left_out=("wrap", "tip_v", "von_mises"))
    before = emulator_of(folder)
    solved_sweep_of_more = solved_sweep(tmp_path / "more", count=40, left_out=("wrap", "tip_v", "von_mises"))
    with opened(solved_sweep_of_more / JOURNAL) as journal:
        later = journal.measurements()[30:]
    with opened(folder / JOURNAL) as journal:
        for each in later:
            journal.add(each)
    after = emulator_of(folder)
    assert (before.count, after.count) == (30, 40)


def test_another_version_of_a_library_fits_it_again(folder, emulator, monkeypatch):
    monkeypatch.setattr(store, "package_versions", lambda: {"scipy": "9"})
    monkeypatch.setattr(store, "fitted_emulator", lambda *_: None)
    assert emulator_of(folder) is None


def test_the_command_prints_every_quantity(folder: Path, emulator: Emulator, capsys: Any) -> None:
    settings = [f"--set={name}={value}" for name, value in FINGER.items()]
    assert main(["predict", str(folder), *settings]) == 0
    printed = capsys.readouterr().out
    assert "ref: predicted from 200 samples" in printed
    assert all(name in printed for name in emulator.names)
    assert "exact" in printed


def test_a_table_of_fingers_is_predicted(folder: Path, emulator: Emulator) -> None:
    found = pr.predict(folder, pd.DataFrame([FINGER, {**FINGER, "height": 100.0}]))
    assert list(found["height_mm"]) == [90, 100]
    assert found["force_N"][0] == pytest.approx(emulator.predict([FINGER])["force"][0])
    assert (found["force_N_low"] < found["force_N"]).all()
    assert "area_mm2_low" not in found
    with pytest.raises(UserError, match="finger 0: height_mm is not varied in this sweep"):
        pr.predict(folder, found)


@pytest.mark.parametrize("line", ["", "--set height=200", "--set N=4 --set rib_count=4"])
def test_the_command_refuses_in_one_line(folder, emulator, line, capsys):
    assert main(["predict", str(folder), *line.split()]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
