"""The content of `metrics.json`: keys, types and where the numbers come from."""

import json
import math
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from pinnray.comparison.evaluation.certifier import with_certificates
from pinnray.comparison.evaluation.scores import Scores
from pinnray.comparison.report.summary import answers
from pinnray.solvers.problem import Problem

KEYS = Path(__file__).with_name("metrics.txt")
"""The entries of `metrics.json`, sorted."""

FREE = (".design", ".stats")
"""Entries whose keys the design and the solver choose."""


@pytest.fixture
def numbers(estimated, pinn, compared, mesh):
    """`numbers(...)`: the metrics of both solvers, with some attributes of the comparison changed."""

    def make(**changes):
        evaluations = with_certificates([estimated, pinn], Problem(mesh))
        return json.loads(json.dumps(compared(*evaluations, **changes).scores.content()))

    return make


def leaves(value: object, path: str) -> Iterator[str]:
    """A line for each entry of nested dictionaries: its path and its type."""
    if isinstance(value, dict) and not path.endswith(FREE):
        for key, inner in value.items():
            yield from leaves(inner, f"{path}.{key}")
    else:
        yield f"{path.removeprefix('.')}: {type(value).__name__}"


def test_keys_and_types(numbers):
    """Scripts rely on these: a key may be added, but not renamed or removed under the same `schema`."""
    assert numbers()["schema"] == 2
    assert sorted(leaves(numbers(), "")) == KEYS.read_text(encoding="utf-8").splitlines()


def test_every_value_is_plain(numbers):
    """Numbers that do not exist are NaN here and null in the file; `fem` has no strain yy at all."""
    told = json.loads(json.dumps(numbers()))
    assert math.isnan(told["solvers"]["pinn-std"]["to_reference"]["strain"]["yy"]["rel_l2"])


def test_the_numbers_are_those_of_the_solvers(numbers, pinn):
    """The markers lie 0.3 mm farther in u than the reference's, 0.4 mm less in v; the network a tenth off."""
    told = numbers()["solvers"]
    assert told["fem"]["markers"]["ae_u"] == pytest.approx(3 * [0.3])
    assert told["fem"]["markers"]["mae_rss"] == pytest.approx(0.5)
    to = told["pinn-std"]["to_reference"]
    assert (to["rel_l2_displacement"], to["rel_l2_von_mises"]) == pytest.approx((0.1, 0.1))
    assert to["rel_energy"] == pytest.approx(0.21)
    told = told["pinn-std"]
    assert (told["energy"], told["reaction"]) == (pinn.energy, pinn.reaction.tolist())
    assert (told["seconds"], told["stats"]["unknowns"]) == (1.25, 450)


def test_without_dolfinx_no_result_is_certified_and_a_warning_says_so(estimated, mesh, monkeypatch):
    monkeypatch.setitem(sys.modules, "pinnray.solvers.fem.linear", None)
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
    assert set(fem["figures"]["places"]) == {"von_mises", "principal_strain", "peak_strain"}
    scores = Scores.read(finished)
    alone = scores.model_copy(update={"solvers": {"fem": scores["fem"]}})
    assert f"{values['force_N']:#.3g} N" in answers(alone)[0].verdict
