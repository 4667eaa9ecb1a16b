"""Questions that are read, and the line for each that is refused."""

from pathlib import Path

import pytest

from geometry.errors import UserError
from studies.optimum.question import Question, load_question

GOOD = """
mesh_size = 2.0
runs = 40
[objectives]
wrap = "largest"
force = "least"
[constraints]
von_mises = {at_most = 2.0}
thinnest_wall = {at_least = 0.8, at_most = 3.0}
[varied]
rib_thickness = {from = 0.6, to = 2.5}
"""


def asked(folder: Path, text: str) -> Question:
    path = folder / "ask.toml"
    path.write_text(text, encoding="utf-8")
    return load_question(path)


def test_costs_are_least_at_the_best(tmp_path: Path) -> None:
    question = asked(tmp_path, GOOD)
    values = {"wrap": 20.0, "force": 3.0, "von_mises": 1.5, "thinnest_wall": 0.7}
    assert question.costs(values) == [-20.0, 3.0]
    assert question.excesses(values) == pytest.approx([-0.5, 0.1])
    assert not question.allows(values)
    assert question.allows(values | {"thinnest_wall": 0.8})
    assert not question.allows(values | {"thinnest_wall": 3.1})
    assert question.samples == 13


REFUSED = {
    "one objective": (GOOD.replace('force = "least"\n', ""), "objectives"),
    "no such quantity": (
        GOOD.replace("wrap =", "wrapping ="),
        "there is no quantity 'wrapping'; there",
    ),
    "no such sense": (GOOD.replace('"largest"', '"most"'), "objectives"),
    "no limit": (
        GOOD.replace("{at_most = 2.0}", "{}"),
        "constraints.von_mises: give at_least, at_most",
    ),
    "limit without a name": (GOOD.replace("{at_most = 2.0}", "2.0"), "write constraints as NAME = {at_least"),
    "a drawing": (
        GOOD.replace("rib_thickness = {from = 0.6, to = 2.5}", 'section = {values = ["a.dxf"]}'),
        "a drawing has no parameters to optimise",
    ),
    "samples": (
        "samples = 4\n" + GOOD,
        "samples belongs to a study; the search",
    ),
    "too few runs": (GOOD.replace("runs = 40", "runs = 4"), "runs = 4 is outside its range, 20 to"),
    "study's own faults": (GOOD.replace("to = 2.5", "to = 0.1"), "from = 0.6 must be below to = 0.1"),
}


@pytest.mark.parametrize(("text", "message"), REFUSED.values(), ids=REFUSED)
def test_a_wrong_question_is_refused_in_one_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(UserError) as error:
        asked(tmp_path, text)
    assert message in str(error.value)
    assert "\n" not in str(error.value)
