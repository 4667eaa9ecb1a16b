"""The page for designers against the program: its tutorial, tables and example files."""

import shlex
import shutil

import pytest

from pinnray.options.preset_jobs import JOBS, JobDefaults
from tests.test_docs import DOCS, blocks, names, table

PAGE = DOCS / "designers.md"


def test_the_page_has_every_quantity_with_its_unit_and_meaning() -> None:
    from pinnray.solvers.finger_figures import QUANTITIES

    rows = table(PAGE, "quantity")
    assert names(rows) == list(QUANTITIES)
    for row, quantity in zip(rows, QUANTITIES.values(), strict=True):
        assert row[1] == (quantity.unit.replace("mm2", "mm²") or "–")
        assert row[2] == quantity.meaning


def test_the_page_has_every_key_of_a_study_and_of_a_question() -> None:
    from pinnray.studies.optimum.question import Question
    from pinnray.studies.sweep.study import Study

    assert names(table(PAGE, "key of a study")) == list(Study.model_fields)
    own = [name for name in Question.model_fields if name not in Study.model_fields]
    assert names(table(PAGE, "key of a question")) == own


@pytest.mark.parametrize("name", ["ribs", "loads", "friction", "fingers", "gridsearch"])
def test_the_example_study_can_be_read(name: str) -> None:
    from pinnray.studies.sweep.study import Study

    Study.load(DOCS / "examples" / f"{name}.toml")


@pytest.mark.parametrize("name", ["wrap.toml", "wrap-cylinder.toml", "grip.toml"])
def test_the_example_questions_can_be_read(name: str) -> None:
    from pinnray.studies.optimum.question import Question

    Question.load(DOCS / "examples" / name)


@pytest.mark.release
@pytest.mark.usefixtures("few_elements", "in_line", "without_pictures")
def test_the_tutorial_runs_from_the_parameters_to_the_printed_finger(tmp_path, monkeypatch):
    from pinnray.cli import compare_main, main

    monkeypatch.setattr("pinnray.studies.optimum.search.ROUNDS", 2)
    monkeypatch.setattr("pinnray.studies.optimum.proposals.POPULATION", 16)  # a quick search for the front
    monkeypatch.setattr("pinnray.studies.optimum.proposals.GENERATIONS", 4)
    monkeypatch.setitem(JOBS, "", JobDefaults(solvers="fem"))
    shutil.copytree(DOCS / "examples", tmp_path / "docs" / "examples")
    quick = {"samples = 64": "samples = 20", "runs = 40": "runs = 20", "mesh_size = 1.0": "mesh_size = 2.0"}
    for name, many in (("ribs", "samples = 64"), ("wrap", "runs = 40")):
        study = tmp_path / "docs" / "examples" / f"{name}.toml"
        text = study.read_text(encoding="utf-8")
        assert many in text
        for slow, fast in quick.items():
            text = text.replace(slow, fast)
        study.write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    for line in blocks(PAGE)[0].text.splitlines():
        program, *arguments = shlex.split(line)
        run = {"pinnray": main, "compare": compare_main}[program]
        assert run(arguments) == 0, line
    written = {path.relative_to(tmp_path / "out").as_posix() for path in (tmp_path / "out").rglob("*")}
    assert {f"ribs/{name}" for name in files("file of a sweep")} <= written
    assert {f"wrap/{name.replace('NN', '01')}" for name in files("file of a search")} <= written
    assert {"first/report.html", "print/finger-body.stl", "print/finger-markers.stl"} <= written


def files(heading: str) -> set[str]:
    """The files that a table of the page names."""
    texts = (row[0].replace("`", "") for row in table(PAGE, heading))
    return {name.strip() for text in texts for name in text.split(",")}
