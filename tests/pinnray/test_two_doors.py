"""The shell and Python refuse the same question with the same sentence."""

import json

import pytest

import pinnray as pr
from pinnray.cli import main
from pinnray.runtime.exits import BAD_INPUT

ASKED = {
    "compare --solvers fem --law gent": lambda: pr.compare(solvers="fem", law="gent"),
    "compare --solvers fem --law hooke": lambda: pr.compare(solvers="fem", law="hooke"),
    "compare --solvers fem --load cilinder": lambda: pr.compare(solvers="fem", load="cilinder"),
    "compare --solvers fem --load cylinder": lambda: pr.compare(solvers="fem", load="cylinder"),
    "compare --solvers fem --friction 0.3": lambda: pr.compare(solvers="fem", friction=0.3),
    "compare --solvers fem --radius 5": lambda: pr.compare(solvers="fem", radius=5),
    "compare --solvers fem --direction 120": lambda: pr.compare(solvers="fem", direction=120),
    "compare --solvers fem --stroke 0": lambda: pr.compare(solvers="fem", stroke=0),
    "compare --solvers fem --material tpu": lambda: pr.compare(solvers="fem", material="tpu"),
    "compare --solvers gp --measurements no.csv": lambda: pr.compare(solvers="gp", measurements="no.csv"),
    "compare --solvers gp --measurements no.mkv": lambda: pr.compare(solvers="gp", measurements="no.mkv"),
    "compare --solvers fem --truth slidin": lambda: pr.compare(solvers="fem", truth="slidin"),
    "compare --solvers fem --reference gp": lambda: pr.compare(solvers="fem", reference="gp"),
    "compare --solvers fem --adapt 0": lambda: pr.compare(solvers="fem", adapt=0),
    "compare --solvers fem,fem": lambda: pr.compare(solvers=["fem", "fem"]),
    "compare --solvers femm": lambda: pr.compare(solvers="femm"),
    "compare --solvers fem --preset local": lambda: pr.compare(solvers="fem", preset="local"),
    "compare --set height=9999": lambda: pr.compare(height=9999),
    "compare --set rib_count=200": lambda: pr.compare(rib_count=200),
    "compare --design slendr": lambda: pr.compare("slendr"),
    "compare --solvers fem --solver-set fem.degree=3": lambda: pr.solver("fem", degree=3),
    "solve fem-nonlinear --solver-set fem-nonlinear.stops=[0.5,2]": lambda: pr.solver(
        "fem-nonlinear", stops=(0.5, 2)
    ),
    "solve fem-3d --solver-set fem-3d.stops=[-1]": lambda: pr.solver("fem-3d", stops=[-1]),
    "solve fem --law gent": lambda: pr.solve(solver="fem", law="gent"),
    "solve gp --measurements no.csv": lambda: pr.solve(solver="gp", measurements="no.csv"),
    "rig --codec x": lambda: pr.rig(out="out/rig", codec="x"),
    "rig --size 4x4": lambda: pr.rig(out="out/rig", frame="4x4"),
    "rig --tilt 90": lambda: pr.rig(out="out/rig", tilt=90),
    "rig --board 9 --boards 2": lambda: pr.rig(out="out/rig", board="9", boards=2),
    "rig --camera no.json": lambda: pr.rig(out="out/rig", camera="no.json"),
    "rig --solver femm": lambda: pr.rig(out="out/rig", solver="femm"),
    "track no.mkv": lambda: pr.track("no.mkv"),
    "track no.mkv --camera no.json": lambda: pr.track("no.mkv", camera="no.json"),
    "track no.mkv --method x": lambda: pr.track("no.mkv", method="x"),
    "track no.mkv --fps -3": lambda: pr.track("no.mkv", fps=-3),
    "track no.mkv --colour pinkish": lambda: pr.track("no.mkv", colour="pinkish"),
    "optimise no.toml": lambda: pr.optimise("no.toml"),
    "export mujoco --load patch": lambda: pr.export("mujoco", out="out/export", load="patch"),
    "export mujoco --material tpu": lambda: pr.export("mujoco", out="out/export", material="tpu"),
}


@pytest.mark.parametrize("line", ASKED)
def test_both_doors_refuse_with_one_sentence(line, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(line.split()) == BAD_INPUT
    said = capsys.readouterr().err.splitlines()[-1]  # after the stages
    with pytest.raises(pr.UserError) as refused:
        ASKED[line]()
    assert said == f"error: {refused.value}"


@pytest.mark.parametrize(
    ("line", "before", "other"),
    [
        ("rig --tilt 3", {"tilt": 4.0}, "tilt"),
        ("track b.mkv", {"source": "a.mkv"}, "source"),
        ("track -", {"source": "-", "recorded": "yesterday"}, "recorded"),
    ],
)
def test_the_usual_folder_keeps_the_run_of_another_job(line, before, other, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "out" / line.split()[0]
    folder.mkdir(parents=True)
    usual = {"codec": "ffv1"} if folder.name == "rig" else {}
    (folder / "run.json").write_text(json.dumps({"files_sha256": {}, "options": usual | before}))
    assert main(line.split()) == BAD_INPUT
    assert f"the finished run of another job (other {other});" in capsys.readouterr().err
