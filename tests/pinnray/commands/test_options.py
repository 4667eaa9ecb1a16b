"""Options of every command: --quiet, completion in a shell."""

from importlib import import_module
from inspect import getdoc
from pathlib import Path

import pytest

import pinnray as pr
from pinnray.cli import main
from pinnray.commands.app import COMMANDS, pinnray
from pinnray.options.shared import PhysicsOptions
from pinnray.runtime.errors import UserError
from pinnray.runtime.exits import BAD_INPUT

HOMES = {command.rpartition(".")[2]: f"pinnray.commands.{command}" for command in COMMANDS}
NAMES = [name for name in pinnray if not name.startswith("-")]


@pytest.mark.parametrize("name", NAMES)
def test_the_help_of_every_command_says_that_it_can_be_quiet(name):
    assert "Every command takes --quiet" in str(pinnray[name].help_epilogue)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "files"),
    [
        ("design --formats dxf --out x", {"section.dxf", "finger.toml", "design.png"}),
        ("mesh --mesh-size 2 --out x", {"mesh.npz", "mesh.png", "mesh.vtu"}),
        ("solve fem --mesh-size 2 --out x/fem.vtu", {"fem.vtu"}),
    ],
)
def test_a_quiet_command_prints_nothing_and_writes_the_same(command, files, tmp_path, monkeypatch, capfd):
    for folder, options in (("loud", []), ("quiet", ["--quiet"])):
        (tmp_path / folder).mkdir()
        monkeypatch.chdir(tmp_path / folder)
        assert main([*command.split(), *options]) == 0
        assert (capfd.readouterr() == ("", "")) == bool(options)
        assert {path.name for path in Path("x").rglob("*")} == files


@pytest.mark.parametrize("name", NAMES)
def test_the_help_of_every_command_is_its_docstring(name):
    """It is read out of the source, without an import."""
    assert pinnray[name].help == getdoc(import_module(HOMES[name]).command)


def test_a_shell_completes_commands_and_options(tmp_path):
    script = tmp_path / "completion"
    assert main(["--install-completion", "--shell", "bash", "--output", str(script)]) == 0
    text = script.read_text(encoding="utf-8")
    assert all(word in text for word in (*NAMES, "--mesh-size", "--seed"))


@pytest.mark.parametrize("columns", ["0", "-1", "1", "²", "1" * 9, ""])
def test_a_width_that_no_terminal_has_does_not_count(columns, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", columns)
    assert main(["design", "--help"]) == 0
    assert max(map(len, capsys.readouterr().out.splitlines())) == 80


def test_a_preset_and_a_material_give_what_no_option_gives() -> None:
    options = PhysicsOptions(material="tpu-95a", poisson=0.4)
    usual = {"young": 26.0, "young_deviation": 5.2, "loss": 0.1}
    assert options.values("paper") == {"load": "point", "poisson": 0.4, **usual}
    # The spread of a preset is not that of another modulus, which may have its own.
    assert PhysicsOptions(material="tpu-95a", young="20").read()[0].young_deviation == 0
    assert PhysicsOptions(material="tpu-95a", young="20±1").read()[0].young_deviation == 1
    assert PhysicsOptions(load="mean").read("paper")[1].kind == "mean"  # though it is the usual one


@pytest.mark.parametrize(
    ("options", "keywords"),
    [
        ("", {}),
        ("--reference fem-asm", {"reference": "fem-asm"}),
        ("--preset trained", {"preset": "trained"}),
        ("--preset paper", {"preset": "paper"}),
        ("--solvers fem,gp", {"solvers": ["fem", "gp"]}),
    ],
)
def test_shell_and_python_choose_the_same_solvers_and_leave_out_the_same(
    options, keywords, monkeypatch, tmp_path
):
    """Where they cannot do the job."""
    monkeypatch.chdir(tmp_path)
    jobs = []

    def seen(job, *_):
        jobs.append(job)
        raise UserError("enough")

    monkeypatch.setattr("pinnray.comparison.pipeline.pipeline.run", seen)
    assert main(["compare", *options.split()]) == BAD_INPUT
    with pytest.raises(UserError, match="enough"):
        pr.compare(out="out", **keywords)
    shell, python = ([*((each.name, each.settings()) for each in job.solvers), *job.spare] for job in jobs)
    assert shell == python
