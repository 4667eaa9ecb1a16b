"""`compare --from`: a run is repeated from its run.json, and a file of options is read or refused."""

import json

import pytest

from pinnray.cli import compare_main

pytestmark = pytest.mark.usefixtures("few_elements_throughout", "without_pictures")

SMALL = ["--solvers", "fem,gp", "--mesh-size", "1.5", "--set", "rib_count=3", "--quiet"]


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
    expected = {"solvers": "fem,gp", "mesh-size": 1.5, "set": ["rib_count=3"]}
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


@pytest.mark.parametrize(
    ("text", "line"),
    [
        # a misspelt option
        ('[options]\nsolverz = "fem"', 'Unknown option: "[solverz]"'),
        # a value of the wrong kind
        ('[options]\nmesh-size = "fine"', 'unable to convert "fine" into float'),
        # names that are those of commands too
        ('[options]\ndesign = "none-such"', "none-such"),
        ('[options]\nsolvers = "none-such"', "no solver is called 'none-such'"),
        # no table
        ("mesh-size = 1", 'no table "options"'),
        # an option outside of the table
        ("mesh-size = 1\n[options]", "unknown key 'mesh-size'"),
        # an output folder that the file, which may be of others, should not choose
        ('[options]\nout = "/tmp/other"', "out = '/tmp/other' leads out of the working folder"),
        ('[options]\nout = ["a/../../other"]', "out = 'a/../../other' leads out of the working folder"),
        # a file of a later version
        ("schema = 2\n[options]", "has schema 2; this version of pinn-ray reads schema 1"),
        ("[options", "cannot read the options file"),
    ],
)
def test_a_file_that_cannot_be_used_is_one_line(text, line, tmp_path, capsys):
    file = tmp_path / "options.toml"
    file.write_text(text, encoding="utf-8")
    assert compare_main(["--from", str(file), "--out", str(tmp_path / "out")]) == 2
    (said,) = capsys.readouterr().err.splitlines()
    assert said.startswith("error: ")
    assert line in said


def test_the_command_line_goes_before_the_file(tmp_path, capsys):
    file = tmp_path / "options.json"
    file.write_text('{"options": {"solvers": "none-such", "mesh-size": 1}}', encoding="utf-8")
    assert compare_main(["--from", str(file), "--solvers", "other"]) == 2
    assert "no solver is called 'other'" in capsys.readouterr().err


def test_a_missing_file_is_one_line(tmp_path, capsys):
    assert compare_main(["--from", str(tmp_path / "none.toml")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
