"""The content of `metrics.json`: keys, types and where the numbers come from."""

import json
import math
import sys
from dataclasses import replace
from numbers import Real

import numpy as np
import pytest

from compare.evaluation.certification import with_certificates
from compare.evaluation.metrics import marker_errors, reference_differences
from compare.report.output_files import metrics
from compare.report.summary import answers
from solvers.problem import Problem

ERRORS = {"mae_u": Real, "mae_v": Real, "mae_sum": Real, "mae_rss": Real}
DIFFERENCE = {"rel_l2": Real, "mean": Real, "p95": Real}
COMPONENTS = {"xx": DIFFERENCE, "yy": DIFFERENCE, "xy": DIFFERENCE}
REGION = {"area": Real, "excess": Real, "rel_l2_displacement": Real, "rel_l2_von_mises": Real}
CERTIFICATE = {
    **dict.fromkeys(("energy", "fem_energy", "excess", "rel_excess", "violation", "rel_violation"), Real),
    **dict.fromkeys(("energy_norm_error", "weak_residual", "imbalance", "missed", "work", "base"), Real),
    "misses_energy": bool,
    "load": list,
    "regions": {"corners": REGION, "contact": REGION, "rest": REGION},
}
DIFFERENCES = {
    "rel_l2_displacement": Real,
    "rel_l2_von_mises": Real,
    "mae_markers": Real,
    "rel_energy": Real,
    "displacement": DIFFERENCE,
    "von_mises": DIFFERENCE,
    "stress": COMPONENTS,
    "strain": COMPONENTS,
}
UNCERTAINTY = {
    **dict.fromkeys(("energy_norm", "rel_l2_displacement", "rel_l2_von_mises", "mae_markers"), Real),
    "markers_u": list,
    "markers_v": list,
}
SOLVER = {
    "family": str,
    "twin": (str, type(None)),
    "law": str,
    "status": str,
    "message": str,
    "seconds": Real,
    "energy": Real,
    "reaction": list,
    "stats": dict,
    "force": (dict, type(None)),
    "figures": (dict, type(None)),
    "certificate": CERTIFICATE,
    "markers": {"in_sample": bool, "ae_u": list, "ae_v": list, **ERRORS},
    "held_out": {"ae_u": list, "ae_v": list, **ERRORS},
    "rigid_motion_off": (dict, type(None)),
    "uncertainty": UNCERTAINTY,
    "to_truth": (dict, type(None)),
    "force_to_truth_rel": (Real, type(None)),
    "to_reference": {**DIFFERENCES, "reference_uncertainty": DIFFERENCES},
}
SCHEMA = {
    "schema": int,
    "design": dict,
    "material": {"young": Real, "poisson": Real, "plane": str, "law": str},
    "load": {
        **{"kind": str, "displacement": tuple, "position": type(None), "radius": (Real, type(None))},
        "friction": Real,
    },
    "measurements": {"source": str, "description": str, "markers": int},
    "warnings": list,
    "reference": str,
    "solvers": {"fem": SOLVER, "pinn-std": {**SOLVER, "uncertainty": type(None)}},
}
"""Scripts rely on these: a key may be added, but not renamed or removed under the same `schema`."""


def assert_schema(value, expected, where="metrics"):
    if not isinstance(expected, dict):
        assert isinstance(value, expected), f"{where} is {value!r}"
        return
    assert set(value) == set(expected), where
    for key, inner in expected.items():
        assert_schema(value[key], inner, f"{where}.{key}")


@pytest.fixture
def numbers(estimated, pinn, compared, mesh):
    """`numbers(...)`: the metrics of both solvers, with some attributes of the comparison changed."""

    def make(**changes):
        evaluations = with_certificates([estimated, pinn], Problem(mesh))
        return metrics(compared(*evaluations, **changes))

    return make


def test_keys_and_types(numbers):
    assert_schema(numbers(), SCHEMA)
    assert numbers()["schema"] == 1


def test_every_value_is_plain(numbers):
    """Numbers that do not exist are NaN here and null in the file; `fem` has no strain yy at all."""
    told = json.loads(json.dumps(numbers()))
    assert math.isnan(told["solvers"]["pinn-std"]["to_reference"]["strain"]["yy"]["rel_l2"])


def test_the_numbers_are_those_of_the_metrics(numbers, fem, pinn, observations):
    told = numbers()["solvers"]["pinn-std"]
    errors, differences = marker_errors(pinn, observations), reference_differences(pinn, fem)
    assert told["markers"]["ae_u"] == errors.ae_u.tolist()
    assert told["markers"]["ae_v"] == errors.ae_v.tolist()
    assert [told["markers"][name] for name in ERRORS] == [getattr(errors, name) for name in ERRORS]
    to = told["to_reference"]
    assert to["rel_l2_displacement"] == differences.displacement.rel_l2 == pytest.approx(0.1)
    assert to["rel_l2_von_mises"] == differences.von_mises.rel_l2 == pytest.approx(0.1)
    assert to["mae_markers"] == differences.mae_markers
    assert to["rel_energy"] == pytest.approx(0.21)
    assert (told["energy"], told["reaction"]) == (pinn.energy, pinn.reaction.tolist())
    assert (told["seconds"], told["stats"]["unknowns"]) == (1.25, 450)


def test_held_out_errors_are_those_of_markers_that_the_solver_was_not_given(numbers, fem, pinn):
    told = numbers(evaluations=[fem, replace(pinn, in_sample=True)])["solvers"]
    assert [told[name]["markers"]["in_sample"] for name in ("fem", "pinn-std")] == [False, True]
    assert told["pinn-std"]["held_out"] is None
    left_out = replace(pinn, in_sample=True, left_out=fem.marker_displacement + np.array([0.0, 0.1]))
    told = numbers(evaluations=[fem, left_out])["solvers"]
    assert told["pinn-std"]["held_out"]["mae_u"] == pytest.approx(0.3)
    assert told["pinn-std"]["held_out"]["mae_v"] == pytest.approx(0.5)
    same = {name: value for name, value in told["fem"]["markers"].items() if name != "in_sample"}
    assert told["fem"]["held_out"] == same


def test_without_dolfinx_no_result_is_certified_and_a_warning_says_so(estimated, mesh, monkeypatch):
    monkeypatch.setitem(sys.modules, "solvers.fem.linear", None)
    with pytest.warns(UserWarning, match="no result is certified: solver 'fem' cannot be loaded"):
        (plain,) = with_certificates([estimated], Problem(mesh))
    assert plain.certificate is None


def test_figures_are_in_newtons_with_their_places_and_open_the_report(finished):
    """A finger with a depth has them; the bodies of the other tests have none."""
    told = json.loads((finished / "metrics.json").read_text(encoding="utf-8"))
    fem, depth = told["solvers"]["fem"], told["design"]["depth"]
    force, values = -depth * fem["reaction"][1], fem["figures"]["values"]
    assert (values["force_N"], values["force_50_N"]) == pytest.approx((force, force / 2))
    assert values["strain_energy_mJ"] == pytest.approx(fem["energy"] * depth)
    assert "force_low_N" not in values
    assert set(fem["figures"]["places"]) == {"von_mises", "principal_strain"}
    network = {**fem, "family": "neural network"}
    first, second, *_ = answers({**told, "solvers": {"fem": fem, "pinn-std": network}})
    assert (first.question[:16], second.question[:13]) == ("May the network ", "What does the")
    told["solvers"] = {"fem": fem}
    assert f"{values['force_N']:#.3g} N" in answers(told)[0].verdict
    values |= {"force_low_N": 4.0, "force_high_N": 5.0, "strain_over_break": 0.75}
    answer = answers(told)[0]
    assert "4.00 to 5.00 N" in answer.verdict
    assert "75%" in answer.sentences[0]
    assert any("(4.00 to 5.00)" in cell for row in answer.table.rows for cell in row)
