"""Bad input of the command line: one line that says what and how to mend it, and nothing is written."""

import os
import re
import shlex
from pathlib import Path

import pytest

from compare.runtime.exits import BAD_INPUT
from pinnray.cli import main
from tests.pinnray.commands.programs import run_python

HEADER = "x_mm,y_mm,u_mm,v_mm"
SMALL = ["compare", "--solvers", "fem", "--mesh-size", "1.0"]

BEAM = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="60mm" height="10mm" viewBox="0 0 60 10">'
    '<path d="M 0 0 H 60 V 10 H 0 Z"/></svg>'
)

INPUTS: dict[str, str | bytes] = {
    "broken.toml": "height = = 90",
    "other.toml": "hight = 90",
    "column.csv": "x_mm,y_mm,u_mm\n20,-1,0\n",
    "text.csv": f"{HEADER}\n20,-1,left,0\n",
    "nan.csv": f"{HEADER}\n20,-1,nan,0\n",
    "outside.csv": f"{HEADER}\n10,-10,0,0\n",
    "unseen.csv": f"{HEADER},visible\n20,-1,,,0\n",
    "flag.csv": f"{HEADER},visible\n20,-1,0,0,2\n",
    "header.csv": f"{HEADER}\n",
    "empty.csv": "",
    "binary.csv": bytes(range(256)),
    "good.csv": f"{HEADER}\n20,-1,0,-5\n85,-1,-2,-0.5\n",
    "file": "",
    "far.csv": f"{HEADER}\n20,-1,1e308,0\n",
    "underscore.csv": f"{HEADER}\n2_0,-1,0,0\n",
    "close.csv": f"{HEADER}\n20,-1,0,-5\n20.000000001,-1,0,5\n",
    "unsure.csv": f"{HEADER},std_u_mm\n20,-1,0,-5,1e-300\n",
    "beam.svg": BEAM,
    "finger.toml": "height = 95",
    "folder.vtu/kept": "",
    "foreign/thesis.txt": "three years of work",
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with files that are wrong in one way each."""
    for name, content in INPUTS.items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    monkeypatch.chdir(tmp_path)
    return tmp_path


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() if path.is_file() else b"" for path in folder.rglob("*")}


# Bad input: one line, exit code 2, nothing written

BAD = [
    # what does not exist
    ("compare --frobnicate", "Unknown option: --frobnicate"),
    (
        "frobnicate",
        "Unknown command .* commands: compare, report, design, mesh, material, solve, ",
    ),
    ("compare slender", "'slender' belongs to no option"),  # forgot --design
    ("compare --seed", "--seed requires an argument"),
    ("compare --solvers fen", r"no solver is called 'fen'; did you mean 'fem'\?"),  # near match
    ("compare --solvers comsol", r"no solver is called 'comsol' \(there are: fem, "),  # nothing near
    ("compare --solvers ,", "no solver was asked for"),
    ("sweep ribs.toml --pictures eps", "there are no pictures as eps; besides PNG there are svg, pdf"),
    ("compare --design slendr", "there is no design 'slendr'; the presets are default, "),
    ("compare --design absent.toml", "there is no design file absent.toml"),
    # designs
    ("compare --design broken.toml", r"cannot read the design file broken.toml: .* line 1"),
    ("compare --design other.toml", r"unknown parameter 'hight'; did you mean height \(H\)"),
    ("compare --set rib_count", "cannot read 'rib_count'; write parameter=value"),
    ("compare --set rib_cuont=3", r"unknown parameter 'rib_cuont'; did you mean rib_count \(N\)\?"),
    ("compare --set rib_count=many", r"rib_count \(N\) = 'many' is not a whole number"),
    ("compare --set N=4 --set rib_count=5", "set twice"),
    ("compare --set rib_count=40", "ribs overlap: .* allowed with the rest unchanged: rib_count up to"),
    ("compare --set height=9999", "outside its range, 10 to 500 mm"),
    ("compare --set contact_position=200", "contact"),  # beyond the tip
    ("compare --set name=../up", "must be a letter or digit"),  # would leave the output folder
    ("compare --set name=finger\u00f6", "then only letters .A to Z., digits"),
    ("compare --set E=3", "E is no parameter of the finger, but of material and load: give --young"),
    (
        "design --set stroke=3",
        "stroke is no parameter of the finger, but of material and load: give --stroke",
    ),
    ("compare --mesh-size 0", "--mesh-size = 0 mm is outside its range"),
    ("compare --mesh-size nan", "--mesh-size = nan is not a finite number"),
    ("compare --mesh-size fine", 'unable to convert "fine" into float'),
    ("compare --adapt 0", "a tolerance of 0 mm at the markers"),
    ("compare --adapt 0.001 --load point", "a point load has no limit under refinement"),
    ("mesh --adapt 0.001 --load point", "a point load has no limit under refinement"),
    # material and load
    ("compare --young -1", r"young \(E\) = -1.0: input should be greater than 0"),
    ("compare --young inf", r"young \(E\) = inf is not a finite number"),
    ("compare --young 1e-300", r"young \(E\) = 1e-300: no solid has this Young's modulus"),
    ("compare --young 11400000", r"young \(E\) = 11400000.0: .* MPa \(1 MPa = 10\^6 Pa\)"),  # in pascals
    ("compare --poisson 0.5", r"poisson \(nu\) = 0.5: input should be less than 0.5"),  # incompressible
    ("compare --stroke 0", "stroke 0: the indenter presses"),
    ("compare --stroke -10", "stroke -10: the indenter presses"),  # not the displacement v
    ("compare --stroke nan", "stroke = nan is not a finite number"),
    (
        "solve fem --mesh-size 1 --stroke 10000 --quiet",  # in micrometres
        "moves the contact by 10000 mm, farther than the finger is large",
    ),
    ("compare --direction 90", "direction 90: give an angle between -90 and 90 degrees"),
    ("compare --direction 5 --slide", "slide leaves the travel along the finger free"),
    ("compare --load pull", 'Choose from: "mean", "point", "patch"'),
    ("compare --radius 5", "a radius belongs to the load cylinder, and to no other"),
    ("solve fem-nonlinear --load cylinder --radius 0", "radius = 0.0: input should be greater than 0"),
    ("solve fem-nonlinear --load cylinder --slide", "a cylinder is moved in u and v"),
    ("solve fem-nonlinear --friction 0.5", "friction belongs to the load cylinder"),
    ("solve fem-nonlinear --load cylinder --friction -1", "friction = -1.* is outside its range, 0 to 5"),
    ("compare --plane stress --solvers fem-nonlinear", "fem-nonlinear: .* plane strain only"),
    ("compare --law hooke", 'Choose from: "linear", "neo-hookean", "st-venant-kirchhoff", "gent"'),
    (
        "compare --solvers fem,gp --law st-venant-kirchhoff",
        r"none of the solvers has it \(fem has linear; gp has linear\)",
    ),
    ("solve fem --law neo-hookean", r"--law neo-hookean: none of the solvers has it \(fem has linear\)"),
    ("gridsearch --law neo-hookean", r"--law neo-hookean: none of the solvers has it \(pinn-std has linear"),
    ("compare --plane stress --law neo-hookean", "the neo-hookean law is given for plane strain only"),
    ("compare --truth none", "there is no truth 'none'"),
    ("compare --truth print", "truth print: its walls are not those of the drawing"),
    ("compare --truth stvk --measurements markers.csv", "is for a simulated experiment"),
    # solvers and their settings
    ("compare --solvers fem,fem", "named twice: fem, fem"),
    ("compare --solvers fem --reference pinn-std", "reference 'pinn-std' is not among the solvers fem"),
    ("compare --solvers fem --solver-set degree=1", "write solver.setting=value"),
    (
        "compare --solvers fem --solver-set pinn-std.neurons=9",
        "'pinn-std', which is not among the solvers fem",
    ),
    ("compare --solvers fem --solver-set fem.order=1", "fem has no setting 'order'; it has degree"),
    ("compare --solvers fem --solver-set fem.degree=two", "fem: degree = 'two'"),
    ("compare --solvers fem --solver-set fem.degree=7", "degree 1 and 2, not 7"),
    ("compare --solvers fem --solver-set fem.degree=1 --solver-set fem.degree=2", "fem.degree is set twice"),
    ("compare --seed -1", "--seed -1: give a whole number from 0"),
    (
        "compare --preset papre",
        r"none of the solvers fem,.* has it \(pinn-std has fast, local, paper, trained;",
    ),
    ("compare --preset paper --solvers fem", "--preset paper: none of the solvers fem has it"),
    ("compare --solver-set pinn-std.ridges=7", "pinn-std: the setting 'ridges' is now called 'neurons'"),
    ("compare --solver-set pinn-std.preset=slow", "pinn-std has no preset 'slow'; it has fast, local, paper"),
    (
        "compare --preset paper --solver-set pinn-std.neurons=9",
        "pinn-std has no setting 'neurons'; it has epochs",
    ),
    ("compare --preset paper --load patch", "pinn-std takes the loads mean, point, not 'patch'"),
    ("compare --device cuda", "--device cuda: none of the solvers fem,.*,statfem can choose a device"),
    ("compare --preset paper --device tpu", "pinn-std: device = 'tpu': input should be 'cpu' or 'cuda'"),
    ("compare --solvers fem --load cylinder", "fem takes the loads mean, point, patch, not 'cylinder'"),
    ("compare --reference fem --load cylinder", "fem takes the loads mean, point, patch, not 'cylinder'"),
    ("compare --solver-set fem.degree=1 --load cylinder", "fem takes the loads mean, point, patch, not 'cyl"),
    (
        "compare --solvers gp --mesh-size 1 --quiet --measurements good.csv",
        "gp .* needs 4 .*, not 2",
    ),
    # measurements
    ("compare --measurements absent.csv", "there is no file absent.csv"),
    ("compare --measurements foreign", "foreign holds no picture"),  # a folder
    ("compare --measurements column.csv", "column.csv has no column v_mm"),
    ("compare --measurements text.csv", "text.csv, line 2: u_mm is 'left', which is not a number"),
    ("compare --measurements nan.csv", "nan.csv, line 2: u_mm is 'nan', which is not a number"),
    ("compare --measurements far.csv", "far.csv, line 2: u_mm is 1e308, beyond 1e[+]06 mm"),
    ("compare --measurements underscore.csv", "line 2: x_mm is '2_0', which is not a number"),  # 20 in Python
    ("compare --measurements close.csv", "close.csv, line 3: there is already a marker at"),
    ("compare --measurements unsure.csv", "unsure.csv: standard deviations must be 0 or from 1e-12 to 1e"),
    ("compare --measurements flag.csv", "flag.csv, line 2: visible is '2'"),
    ("compare --measurements unseen.csv", "unseen.csv: none of the markers is visible"),
    ("compare --measurements header.csv", "header.csv has a header but no marker"),
    ("compare --measurements empty.csv", "empty.csv has no column x_mm"),
    ("compare --measurements binary.csv", "binary.csv: it is not a CSV file in UTF-8"),
    ("compare --mesh-size 1 --measurements outside.csv", "not of this finger: .* outside the body"),
    ("solve fem --measurements outside.csv", "fem does not assimilate markers; `compare` compares"),
    ("solve fem-asm --measurements absent.csv", "there is no file absent.csv"),
    ("solve fem-asm --mesh-size 1 --measurements outside.csv", "not of this finger: .* outside the body"),
    # where to write
    ("compare --out foreign", "foreign holds thesis.txt, and it has no run.json"),
    ("compare --out file", "file is a file; name an output folder"),
    ("compare --out file/below", "cannot write to .*: Not a directory"),
    ("compare --out /proc/absent/run", "cannot write to /proc/absent/run.partial"),  # whoever runs this
    ("compare --out .", "cannot run inside it"),
    # the other verbs
    ("solve", "no solver was named .there are: fem, fem-nonlinear, "),
    ("solve fem,pinn-std", "name one solver, not 'fem,pinn-std'"),
    ("solve ''", "no solver was named"),
    ("crossval --measurements film.mkv", "takes a CSV file of displacements, .*pinnray track. makes one"),
    ("solve fem-asm --measurements film.mkv", "takes a CSV file of displacements, and no film"),
    ("compare --solvers pinn-std --device cuda", "can choose a device; with --preset paper one can"),
    ("compare --solvers fem --device cuda", "none of the solvers fem can choose a device"),
    ("solve fem --out folder.vtu", "--out folder.vtu: this is a folder; name a file that ends in .vtu"),
    ("design --design finger.toml --formats svg --out .", "this would overwrite finger.toml, which is read"),
    ("design --section beam.svg --set depth=5 --set depth=6", "depth is set twice"),
    ("design --section beam.svg --clamp '[[nan, 0], [0, -10]]'", r"clamp = \[\[nan, .*no pair of points"),
    ("fiducials --marker-plane nan", "workspace: marker_plane: Input should be a finite number"),
    ("fiducials --marker-plane 1e9", "workspace: marker_plane: Input should be less than or equal to 1000"),
    ("fiducials --square 1e9", "a square of 1e[+]09 mm; its side must be 0.2 to 1000 mm"),
    ("crossval --solvers fem --noise 1e6", "noise 1e[+]06: .* zero or more, at most 100 mm"),  # a kilometre
    ("solve fem --out fields.csv", "give a name that ends in .vtu"),
    ("gridsearch --learning-rates 1e-3;1e-2", "--learning-rates 1e-3;1e-2: give numbers with commas"),
    ("gridsearch --bc-weights 1,1.0", "--bc-weights 1,1.0: give different numbers above 0"),
    ("gridsearch --bc-weights 0", "--bc-weights 0: give different numbers above 0"),
    ("gridsearch --learning-rates inf", "--learning-rates inf: give different numbers above 0"),
    ("gridsearch --processes 0", "--processes 0: give a whole number from 1"),
    ("gridsearch --epochs 0", "pinn-std: epochs must be positive, got 0"),
    ("gridsearch --epochs 9 --solver-set pinn-std.epochs=8", "pinn-std.epochs is set twice"),
    ("gridsearch --preset fast", "--preset fast: the search is for the settings of the preset paper"),
    ("gridsearch --solver-set pinn-std.bc_weight=1", "is what is searched for; give its values with --bc-we"),
    ("gridsearch --solver-set pinn-asm.neurons=3", "'pinn-asm', which is not among the solvers pinn-std"),
    ("gridsearch --load patch", "pinn-std takes the loads mean, point, not 'patch'"),
    ("gridsearch --out foreign", "foreign holds files that are not of a grid search"),
    ("gridsearch --out file", "file is a file; name an output folder"),
    ("design --formats step,dwg", "unknown CAD format 'dwg'; there are step, stl, dxf, svg"),
    ("mesh --mesh-size 1 --out file", "--out file: this is a file; name a folder"),
]


@pytest.mark.parametrize(("line", "message"), BAD, ids=[line for line, _ in BAD])
def test_bad_input_is_one_line_and_nothing_is_written(folder, capsys, line, message):
    before = contents(folder)
    assert main(shlex.split(line)) == BAD_INPUT
    output = capsys.readouterr()
    assert output.out == ""
    (error,) = output.err.splitlines()
    assert error.startswith("error: ")
    assert re.search(message, error), error
    assert contents(folder) == before


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_read_only_folder_is_one_line(folder, capsys):
    (folder / "foreign").chmod(0o555)
    assert main([*SMALL, "--out", "foreign/run"]) == BAD_INPUT
    assert capsys.readouterr().err.endswith("run.partial: Permission denied\n")


def test_a_link_to_itself_is_no_output_folder(folder, capsys):
    Path("loop").symlink_to("loop")
    assert main([*SMALL, "--out", "loop"]) == BAD_INPUT
    assert capsys.readouterr().err == "error: loop is a link that leads nowhere; name an output folder\n"


def test_a_drawing_is_not_replaced_by_what_is_drawn_from_it(folder, capsys):
    Path("section.svg").write_text(BEAM)
    assert main(["design", "--section", "section.svg", "--formats", "svg", "--out", "."]) == BAD_INPUT
    assert "this would overwrite section.svg, which is read" in capsys.readouterr().err
    assert Path("section.svg").read_text() == BEAM


@pytest.mark.parametrize(
    ("command", "closed"),
    [("--version", "<&-"), ("solvers", ">&-"), ("--version", "2>&-")],  # a table by Rich where it is closed
)
def test_a_closed_stream_is_no_fault(command, closed):
    done = run_python("-m", "pinnray.cli", command, after=closed)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    ("before", "argument", "said"),
    [
        ("ulimit -n 16;", "out", "the limit of open files is 16; allow 128 (ulimit -n 128)"),
        (
            "ulimit -f 8;",
            "out",
            "files may not become longer than 8192 bytes; allow 16777216 (ulimit",
        ),
        ("", "a\udcff", r"the argument 'a\udcff' is not UTF-8; take another name"),
    ],
)
def test_what_the_libraries_cannot_start_with_is_one_line(folder, before, argument, said):
    """MPI aborts with forty lines, or is killed by SIGXFSZ, and DOLFINx ends in a traceback."""
    line = ["-m", "pinnray.cli", "compare", "--solvers", "fem", "--out", argument]
    done = run_python(*line, before=before)
    assert (done.returncode, done.stderr.count("\n")) == (BAD_INPUT, 1)
    assert done.stderr.startswith(f"error: {said}")


def test_bad_input_of_a_process_has_no_traceback(folder):
    done = run_python("-m", "pinnray.cli", "compare", "--solvers", "fen")
    assert (done.returncode, done.stdout) == (BAD_INPUT, "")
    assert done.stderr.startswith("error: no solver is called 'fen'")
    assert done.stderr.count("\n") == 1
