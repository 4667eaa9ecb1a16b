"""`pinnray track` from the command line to its files, and what it refuses."""

import csv
import json

import cv2
import numpy as np
import pytest

from pinnray.cli import main
from pinnray.runtime.exits import BAD_INPUT
from pinnray.vision.frames.pictures import write_picture
from pinnray.vision.frames.sources import open_frames
from pinnray.vision.measurements import read_measurements

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("few_elements_throughout", "discs_fitted_once")]

QUICK = "--mesh-size 1 --rest 3 --moving 0 --held 3 --noise 2 --tilt 4 --seed 1"


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    out = tmp_path_factory.mktemp("film") / "rig"
    assert main(["rig", *QUICK.split(), "--out", str(out)]) == 0
    return out


@pytest.fixture(scope="module")
def tracked(film, tmp_path_factory):
    out = tmp_path_factory.mktemp("tracked") / "track"
    files = ["--camera", str(film / "camera.json"), "--workspace", str(film / "workspace.json")]
    assert main(["track", str(film / "video.mkv"), *files, "--out", str(out)]) == 0
    return out


def test_a_video_becomes_measurements_within_hundredths_of_a_millimetre(film, tracked):
    found, true = (
        read_measurements(path, marker_radius=0.8)
        for path in (tracked / "observations.csv", film / "observations_true.csv")
    )
    assert found.visible.all()
    assert np.abs(found.displacements - true.displacements).sum(axis=1).mean() < 0.02
    np.testing.assert_allclose(found.points, true.points, rtol=0, atol=0.02)


def test_what_is_tracked_in_a_film_of_the_rig_is_simulated(film, tracked):
    assert (tracked / "observations.csv").read_text(encoding="utf-8").startswith("# simulated\n")
    found = read_measurements(tracked / "observations.csv", marker_radius=0.8)
    assert found.source.startswith("simulated by pinnray rig, tracked by pinnray track (precise, ")
    assert json.loads((tracked / "track.json").read_text(encoding="utf-8"))["simulated"] is True


@pytest.fixture
def pictures(film, tmp_path):
    """The film as a folder of pictures, which say no times."""
    folder = tmp_path / "shots"
    folder.mkdir()
    with open_frames(film / "video.mkv") as frames:
        for frame in frames:
            write_picture(folder / f"{frame.number}.png", frame.image)
    return folder


@pytest.mark.parametrize(("fps", "warned"), [(None, True), pytest.param(10.0, False)])
def test_the_times_of_pictures_are_those_that_are_given(film, pictures, tmp_path, capsys, fps, warned):
    given = [] if fps is None else ["--fps", str(fps)]
    line = ["track", str(pictures), "--camera", str(film / "camera.json"), *given]
    assert main([*line, "--without-video", "--out", str(tmp_path / "out")]) == 0
    said = "times are counted at an assumed 30 frames a second"
    assert (said in capsys.readouterr().err) == warned
    with (tmp_path / "out" / "tracks.csv").open(encoding="utf-8") as file:
        times = {float(row["time_s"]) for row in csv.DictReader(file)}
    assert sorted(times) == pytest.approx([number / (fps or 30.0) for number in range(6)])


def test_a_film_that_says_its_times_takes_no_others(film, tmp_path, capsys):
    line = ["track", str(film / "video.mkv"), "--fps", "240", "--out", str(tmp_path / "out")]
    assert main(line) == BAD_INPUT
    assert "says 30 frames a second itself" in capsys.readouterr().err


def test_the_same_frames_come_through_a_pipe(film, tracked, tmp_path, monkeypatch, capsys):
    with open_frames(film / "video.mkv") as frames:
        pictures = [cv2.imencode(".png", frame.image)[1].tobytes() for frame in frames]
    (tmp_path / "pictures").write_bytes(b"".join(pictures))
    files = ["--camera", str(film / "camera.json"), "--workspace", str(film / "workspace.json")]
    with (tmp_path / "pictures").open() as pipe:
        monkeypatch.setattr("sys.stdin", pipe)
        options = ["--publish", "--out", str(tmp_path / "out")]
        assert main(["track", "-", *files, *options]) == 0
    said = capsys.readouterr()
    # The pictures were encoded anew and lost the rig's mark, but its workspace has one, too.
    assert "the workspace is that of a film of pinnray rig" in said.err
    lines = [json.loads(line) for line in said.out.splitlines()]
    assert [line["frame"] for line in lines] == list(range(len(pictures)))
    assert all(line["force"] is None and None not in line["markers_mm"] for line in lines)
    assert (tmp_path / "out" / "observations.csv").read_text().startswith("# simulated\n")
    found, before = (
        read_measurements(folder / "observations.csv", marker_radius=0.8).displacements
        for folder in (tmp_path / "out", tracked)
    )
    np.testing.assert_allclose(found, before, rtol=0, atol=0.001)  # live looks at fewer fiducials


def test_its_files_are_whole(tracked):
    names = {path.name for path in tracked.iterdir()}
    assert names == {
        *("annotated.mp4", "final.png", "initial.png", "observations.csv"),
        *("run.json", "track.json", "tracks.csv"),
    }
    with open_frames(tracked / "annotated.mp4") as frames:
        assert len(list(frames)) == 6
    with (tracked / "tracks.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 6 * 9
    assert float(rows[-1]["x_mm"]) - float(rows[8]["x_mm"]) < -1
    summary = json.loads((tracked / "track.json").read_text(encoding="utf-8"))
    assert summary["rest"] == {"initial": [0, 2], "final": [3, 5]}
    assert np.shape(summary["displacement_covariance_mm2"]) == (18, 18)
    run = json.loads((tracked / "run.json").read_text(encoding="utf-8"))
    assert set(run["files_sha256"]) == names - {"run.json"}


def spoilt(kind, film, folder):
    """A source that is no film of the finger, and further options."""
    whole = (film / "video.mkv").read_bytes()
    video = folder / "video.mkv"
    if kind in ("black", "mirrored"):
        with open_frames(film / "video.mkv") as frames:
            for frame in frames:
                image = 0 * frame.image if kind == "black" else np.ascontiguousarray(frame.image[:, ::-1])
                write_picture(folder / f"{frame.number}.png", image)
        return [str(folder)]
    damaged = {"corrupt": whole[:1000] + bytes(len(whole) - 1000), "cut off": whole[: len(whole) // 2]}
    video.write_bytes(damaged.get(kind, whole))
    corners = ((0, 0), (50, 0), (50, 30), (0, 30), (20, 60))
    (folder / "other.json").write_text(json.dumps({"fiducials": corners}))
    options = {
        "other design": ["--set", "height=60", "--set", "tip_length=12"],
        "other workspace": ["--workspace", str(folder / "other.json")],
        "no camera": ["--camera", str(folder / "other.json")],
    }
    return [str(video), *options.get(kind, [])]


DEAR = [pytest.param(kind) for kind in ("mirrored", "other design")]


@pytest.mark.parametrize("kind", ["corrupt", "cut off", "black", "other workspace", "no camera", *DEAR])
def test_what_cannot_be_tracked_is_one_line_and_writes_nothing(kind, film, tmp_path, capfd):
    source, out = tmp_path / "source", tmp_path / "out"
    source.mkdir()
    assert main(["track", *spoilt(kind, film, source), "--out", str(out)]) == BAD_INPUT
    assert len([line for line in capfd.readouterr().err.splitlines() if line.startswith("error")]) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["source"]


def test_compare_goes_from_pixels_to_the_table(film, tmp_path, without_pictures):
    out = tmp_path / "out"
    options = ["--solvers", "fem", "--mesh-size", "1", "--camera", str(film / "camera.json")]
    video = str(film / "video.mkv")
    assert main(["compare", *options, "--measurements", video, "--out", str(out)]) == 0
    assert read_measurements(out / "observations.csv", marker_radius=0.8).label == "simulated"
    metrics = json.loads((out / "metrics.json").read_text(encoding="utf-8"))
    assert metrics["measurements"]["source"] == "simulated"
    pictures = {"initial.png", "final.png", "predicted.png"}
    assert {path.name for path in (out / "track").iterdir()} >= pictures
    run = json.loads((out / "run.json").read_text(encoding="utf-8"))
    assert len(run["film"]["video_sha256"]) == 64
    assert "track/final.png" in run["files_sha256"]
