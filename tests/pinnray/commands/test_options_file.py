"""`compare --from`: a run is repeated from its run.json, and a file of options is read or refused."""

import json

import pytest

from pinnray.cli import compare_main

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("few_elements_throughout", "without_pictures")]

SMALL = ["--solvers", "fem", "--mesh-size", "1.5", "--set", "rib_count=3", "--quiet"]


def without_times(value):
    if not isinstance(value, dict):
        return value
    return {key: without_times(inner) for key, inner in value.items() if not key.endswith("seconds")}


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    out = tmp_path_factory.mktemp("first") / "run"
    assert compare_main([*SMALL, "--out", str(out)]) == 0
    return out


def read(path):
    return json.loads(path.read_text(encoding="utf-8"))


def test_a_run_has_the_options_that_were_given(first):
    expected = {"solvers": "fem", "mesh-size": 1.5, "set": ["rib_count=3"]}
    assert read(first / "run.json")["options"] == expected


def test_a_repeated_run_has_the_same_metrics(first, tmp_path, capsys):
    code = compare_main(["--from", str(first / "run.json"), "--out", str(tmp_path / "again"), "--quiet"])
    assert (code, capsys.readouterr().err) == (0, "")
    repeated, metrics = (without_times(read(out / "metrics.json")) for out in (tmp_path / "again", first))
    assert repeated == metrics


def test_other_versions_and_inputs_are_noted(first, tmp_path, capsys):
    earlier = read(first / "run.json")
    earlier["versions"]["numpy"] = "0.9"
    earlier["design_sha256"] = "another"
    (tmp_path / "run.json").write_text(json.dumps(earlier), encoding="utf-8")
    compare_main(["--from", str(tmp_path / "run.json"), "--out", str(tmp_path / "again"), "--quiet"])
    versions, inputs = capsys.readouterr().err.splitlines()
    assert "run.json was made with numpy 0.9 (now" in versions
    assert inputs.endswith("run.json: design")
