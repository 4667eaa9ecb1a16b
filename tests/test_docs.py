"""The documentation against the program: examples, code blocks, command lines, tables, links, names."""

import ast
import csv
import inspect
import json
import pkgutil
import re
import runpy
import shlex
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from pydantic import BaseModel

import pinnray as pr
from pinnray.cli import QUIET, compare_main, main
from pinnray.commands.app import pinnray
from pinnray.geometry.cache import CAD_FORMATS, finger_mesh
from pinnray.geometry.finger.markers import marker_positions
from pinnray.geometry.finger.parameters import Parameters, parameter_info
from pinnray.geometry.finger.presets import FOLDER, load_design, preset_names
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.options.preset_jobs import JOBS, JobDefaults
from pinnray.solvers.registry import BUILT_IN, PRESETS, make_solver
from pinnray.solvers.solver import Solver, Traits
from pinnray.vision.rig.exposure import Exposure
from pinnray.vision.rig.motion import Motion

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
HOW_TO, REFERENCE = DOCS / "how-to", DOCS / "reference"
OWN_FINGER, OWN_TRUTH = HOW_TO / "own-finger.md", HOW_TO / "own-truth.md"
MEASUREMENTS = HOW_TO / "measurements.md"
FORCE, MESH, RIG, TRAIN = (HOW_TO / f"{name}.md" for name in ("force", "mesh", "rig", "train"))
PARAMETERS, SOLVERS, FILES = (REFERENCE / f"{name}.md" for name in ("parameters", "solvers", "files"))
OWN_SOLVER, TRUST = DOCS / "own-solver.md", DOCS / "explanation" / "trust.md"
PAGES = sorted([*DOCS.rglob("*.md"), *ROOT.glob("*.md")])
PLUGIN = ROOT / "tests" / "solvers" / "plugin"

PLACEHOLDERS = ("COMPONENT", "DIFFERENCE", "FIELD", "FIGURE", "NAME", "PARAMETER", "REGION", "STAT", "UNIT")
"""Words of the tables that stand for any name."""


class Block(NamedTuple):
    """A fenced block: where it is, its language and its text."""

    page: Path
    line: int
    language: str
    text: str


def blocks(page: Path) -> list[Block]:
    text = page.read_text(encoding="utf-8")
    return [
        Block(page, text[: match.start()].count("\n") + 1, match[1], match[2])
        for match in re.finditer(r"^```(.*?)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    ]


def without_blocks(text: str) -> str:
    return re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)


def id_of(value: object) -> str:
    if isinstance(value, Block):
        return f"{id_of(value.page)}:{value.line}"
    return value.relative_to(ROOT).as_posix() if isinstance(value, Path) else str(value)


def is_plugin(block: Block) -> bool:
    return block.text in {path.read_text(encoding="utf-8") for path in PLUGIN.glob("*.*") if path.is_file()}


ALL_BLOCKS = [block for page in PAGES for block in blocks(page)]
PYTHON = [block for block in ALL_BLOCKS if block.language == "python" and not is_plugin(block)]
OF_RESULTS = [block for block in PYTHON if '"out' in block.text]
"""Those that read what a command of the page has written."""
TO_RUN = [
    block
    for block in PYTHON
    if block not in OF_RESULTS and block.page.name not in ("notebook.md", "explore.md")
]
"""Those of the notebook page run, with output, in `tests/pinnray/test_notebook.py`. The explorer's needs
a sweep of a quarter of an hour; what it calls has tests in `tests/studies/fields`."""


def table(page: Path, first_column: str, after: str = "") -> list[list[str]]:
    """Cells of the first table whose header starts with `first_column`, after some text."""
    text = page.read_text(encoding="utf-8")
    lines = iter(text[text.index(after) :].splitlines())
    assert any(line.startswith(f"| {first_column} |") for line in lines), f"no table of {first_column}"
    next(lines)
    rows = []
    for line in lines:
        if not line.startswith("|"):
            break
        rows.append([cell.strip() for cell in line.strip("|").split(" | ")])
    return rows


def names(rows: list[list[str]]) -> list[str]:
    """The first column without its links and backquotes."""
    return [re.sub(r"^\[(.+)\]\(.+\)$", r"\1", row[0]).strip("`") for row in rows]


def assert_same(documented: list[str], actual: list[str]) -> None:
    """Every actual name is documented, by itself or with placeholders, and nothing else is."""
    patterns = {
        name: re.compile(re.sub("|".join(PLACEHOLDERS), r"[A-Za-z0-9_-]+?", re.escape(name)))
        for name in documented
    }
    undocumented = [name for name in actual if not any(each.fullmatch(name) for each in patterns.values())]
    absent = [name for name, each in patterns.items() if not any(map(each.fullmatch, actual))]
    assert (undocumented, absent) == ([], [])


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory) -> Path:
    """The output of a small comparison, of a solver that follows the load and one that is trained too."""
    out = tmp_path_factory.mktemp("docs") / "run"
    options = (
        "--solvers fem,fem-nonlinear,pinn-std --mesh-size 2 --adapt 0.02 --solver-set pinn-std.preset=paper "
        "--solver-set pinn-std.epochs=2 --solver-set pinn-std.width=4 --quiet"
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(finger_mesh.__kwdefaults__, "across", 1)  # few elements
        patch.setattr("pinnray.runtime.figure.DPI", 20)  # coarse pictures
        code = compare_main([*options.split(), "--out", str(out)])
    assert code in (0, 3)  # so short a training may not converge
    return out


EXAMPLES = sorted((DOCS / "examples").glob("*.py"))


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=id_of)
def test_examples_run_and_find_their_number(path, capsys, request):
    if path.stem == "rib_sweep":  # three fingers under a cylinder
        request.getfixturevalue("few_elements")
    runpy.run_path(str(path), run_name="__main__")
    assert capsys.readouterr().out


def test_examples_pin_a_number():
    pinned = re.compile(r"^    assert abs\(.+\) < [\d.]+$", re.MULTILINE)
    assert [path for path in EXAMPLES if not pinned.search(path.read_text(encoding="utf-8"))] == []


def marked(block: Block):
    """The code of the gallery's pictures waits for a release: its subjects have tests of their own."""
    mark = pytest.mark.release if block.page.name == "gallery.md" else pytest.mark.slow
    return pytest.param(block, marks=mark, id=id_of(block))


@pytest.mark.parametrize("block", map(marked, TO_RUN))
def test_python_in_the_docs_runs(block, tmp_path, monkeypatch, without_pictures):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(JOBS, "", JobDefaults(solvers="fem,gp"))  # all have a test of the benchmark `default`
    padded = "\n" * block.line + block.text  # so that a traceback names the page's own line
    exec(compile(padded, str(block.page), "exec"), {"__name__": "__docs__"})


def run_on_results(page: Path) -> None:
    """Run the blocks of a page that read results, which are in the working folder."""
    (block,) = (block for block in OF_RESULTS if block.page == page)
    exec(compile(block.text, str(page), "exec"), {"__name__": "__docs__"})


def test_the_plug_in_in_the_docs_is_the_one_that_is_tested():
    sources = {(PLUGIN / name).read_text(encoding="utf-8") for name in ("pinnray_skfem.py", "pyproject.toml")}
    assert sources <= {block.text for block in blocks(OWN_SOLVER)}


def test_every_block_says_its_language():
    assert [block for block in ALL_BLOCKS if not block.language] == []


def command_lines() -> list[tuple[str, str]]:
    """Every `compare ...` and `pinnray ...` of the pages, in blocks and in running text, with its page."""
    found = []
    for page in PAGES:
        if page.name == "CHANGELOG.md":  # which tells of commands that are gone
            continue
        text = page.read_text(encoding="utf-8")
        shell = (block.text for block in blocks(page) if block.language == "sh")
        candidates = [line for text in shell for line in text.splitlines()]
        prose = without_blocks(text)
        candidates += re.findall(r"^    (\S.*)$", prose, re.MULTILINE) + re.findall(r"`([^`\n]+)`", prose)
        for candidate in candidates:
            line = candidate.strip().removeprefix("$ ").removeprefix(".venv/bin/")
            if made := re.match(r'make compare ARGS="(.*)"$', line):
                line = f"compare {made[1]}"
            if line.startswith(("docker run", ".ci/container")) and " compare " in line:
                line = "compare " + line.split(" compare ", 1)[1]
            if re.match(r"(compare|pinnray) \S", line):
                found.append((id_of(page), line))
    return sorted(set(found))


@pytest.mark.parametrize(("page", "line"), command_lines())
def test_command_lines_parse(page, line):
    tokens = [token for token in shlex.split(line, comments=True) if token != QUIET]
    tokens = tokens[1:] if tokens[0] == "pinnray" else tokens
    if "--from" in tokens:  # a file of an earlier run
        at = tokens.index("--from")
        del tokens[at : at + 2]
    if len(tokens) == 1:  # the name of a command
        assert tokens[0] in set(pinnray)
        return
    _, bound, _ = pinnray.parse_args(tokens, exit_on_error=False, print_error=False)
    given = bound.arguments
    finger = given.get("finger")
    if finger is not None and finger.section is not None:
        assert (ROOT / finger.section).is_file()
    if "/" in str(given.get("measurements", "")):  # a file of this repository
        assert (ROOT / given["measurements"]).is_file()
    elif finger is not None and not finger.design.endswith(".toml"):
        finger.read()
    if "physics" in given:
        given["physics"].read()


def test_no_command_has_a_placeholder_that_a_shell_takes_for_a_file():
    lines = [line for block in ALL_BLOCKS if block.language == "sh" for line in block.text.splitlines()]
    lines += re.findall(r"^    (\S.*)$", (ROOT / "README.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert [line for line in lines if re.search(r"<[\w ]+>", line)] == []


@pytest.mark.parametrize("page", PAGES, ids=id_of)
def test_relative_links_lead_somewhere(page):
    text = without_blocks(page.read_text(encoding="utf-8"))
    broken = []
    links = re.findall(r'\]\(([^)\s]+)(?:\s+"[^"]*")?\)', text)
    for target in links + re.findall(r'(?:src|href)="([^"]+)"', text):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        other = (page.parent / path) if path else page
        if not other.exists() or (anchor and anchor not in anchors(other)):
            broken.append(target)
    assert broken == []


@pytest.mark.parametrize("page", [page for page in PAGES if page.name != "CHANGELOG.md"], ids=id_of)
def test_files_and_modules_that_a_page_names_exist(page):
    text = page.read_text(encoding="utf-8")
    folders = "runtime|geometry|solvers|vision|compare|robots|studies|pinnray|benchmarks"
    paths = re.findall(rf"(?<![\w/.-])(?:{folders}|tests|docs|tools)/[\w/-]+(?:\.\w+)?", text)
    assert [path for path in paths if not (ROOT / path).exists()] == []
    tests = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("test_*.py"))
    assert [
        name for name in re.findall(r"tests/[^`]* -k (\w+)(?![\w-])", text) if f"{name}(" not in tests
    ] == []
    for name in re.findall(r"`((?:pinnray|benchmarks)(?:\.\w+)+)[`(]", without_blocks(text)):
        if not set(name.split(".")) & {*PLACEHOLDERS}:
            pkgutil.resolve_name(name)


def anchors(page: Path) -> set[str]:
    """The anchors that GitHub gives a page's headings."""
    text = without_blocks(page.read_text(encoding="utf-8"))
    headings = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


KEYS = ("symbol", "unit", "low", "high")


def described(model: type[BaseModel], *, symbols: bool) -> list[str]:
    """The rows that the docs must have for a model's fields."""
    rows = []
    for name, field in model.model_fields.items():
        symbol, unit, low, high = (parameter_info(name, key, model) for key in KEYS)
        default = "none" if field.default is None else field.default
        cells = [
            f"`{name}`",
            *([f"`{symbol}`" if symbol else "–"] if symbols else []),
            unit or "–",
            f"{default:g}" if isinstance(default, int | float) else default,
            "–" if low == "" else f"{low:g} to {high:g}",
            (field.description or "").split(" [")[0],
        ]
        rows.append("| " + " | ".join(cells) + " |")
    return rows


@pytest.mark.parametrize(
    ("page", "column", "model"),
    [
        (PARAMETERS, "parameter", Parameters),
        (MESH, "setting", MeshSettings),
        (RIG, "exposure", Exposure),
        (RIG, "motion", Motion),
    ],
)
def test_the_docs_have_every_field_of_a_model_as_it_is(page, column, model):
    lines = page.read_text(encoding="utf-8").splitlines()
    expected = described(model, symbols=model is Parameters)
    assert [row for row in expected if row not in lines and "`monochrome`" not in row] == []
    assert names(table(page, column)) == list(model.model_fields)


RIG_LINE = "rig --size 320x180 --rest 1 --moving 0 --held 1 --boards 1 --square 20"
FOLDS_LINE = "crossval --solvers fem,fem-asm --schemes one-out --seeds 1"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("line", "page", "column", "words"),
    [
        (RIG_LINE, RIG, "file of a film", {"NUMBER": "NAME"}),
        (FOLDS_LINE, OWN_TRUTH, "file of a cross-validation", {}),
    ],
)
def test_the_docs_have_every_file_of_a_command(
    line, page, column, words, tmp_path, monkeypatch, in_line, few_elements
):
    out = tmp_path / "out" / f"{line.split()[0]}-default"
    assert main([*line.split(), "--mesh-size", "2", "--out", str(out)]) == 0
    documented = names(table(page, column))
    for word, meant in words.items():
        documented = [name.replace(word, meant) for name in documented]
    assert_same(documented, [path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()])
    if page == OWN_TRUTH:
        monkeypatch.chdir(tmp_path)
        run_on_results(page)


def test_the_docs_have_every_preset_as_it_is():
    rows = table(PARAMETERS, "preset")
    assert sorted(names(rows)) == sorted(preset_names())
    for name, text in zip(names(rows), (row[1] for row in rows), strict=True):
        values = tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))
        changed = {key: each for key, each in values.items() if each != Parameters.model_fields[key].default}
        words = re.findall(r"`(\w+)` ([\w.]+)", text)
        said = {key: float(value) if value[0].isdigit() else value for key, value in words}
        assert said == changed, name


def settings_of(solvers: Iterable[Solver]) -> dict[str, str]:
    return {
        f"{solver.name}.{key}": str(value) for solver in solvers for key, value in solver.settings().items()
    }


GIVEN_MARKERS = {"pinn-asm": "pinn-std"}
"""Solvers that have all settings of another one, and those of assimilation."""


def test_the_docs_have_every_solver_setting_as_it_is():
    rows = table(SOLVERS, "setting")
    assert {name: row[1] for name, row in zip(names(rows), rows, strict=True)} == settings_of(
        make_solver(name) for name in BUILT_IN if name not in GIVEN_MARKERS
    )


@pytest.mark.parametrize("preset", PRESETS["pinn-asm"])
def test_the_docs_have_the_settings_of_assimilation_as_they_are(preset):
    rows = table(SOLVERS, "setting of `pinn-asm`")
    documented = {key: row[1] for key, row in zip(names(rows), rows, strict=True)}
    own, shared = (make_solver(name, preset=preset).settings() for name in ("pinn-asm", "pinn-std"))
    assert own.items() >= shared.items()
    if preset == "paper":  # the rows say so
        documented["marker_radius"] = "0.0"
        del documented["choose"], documented["contact_deviation"]
    assert {key: str(own[key]) for key in own if key not in shared} == documented


def test_the_docs_have_every_setting_of_the_other_presets_as_it_is():
    for name, (_, *others) in PRESETS.items():
        if name in GIVEN_MARKERS:
            continue
        for preset in others:
            rows = table(SOLVERS if preset == "local" else TRAIN, f"setting of `{preset}`")
            documented = {name: row[1] for name, row in zip(names(rows), rows, strict=True)}
            assert documented == settings_of([make_solver(name, preset=preset)])


def test_every_public_name_has_an_example_with_arguments_that_it_takes():
    rows = table(REFERENCE / "python" / "pinnray.md", "name")
    documented = [re.findall(r"`pr\.(\w+)", row[0])[0] for row in rows]
    assert sorted(documented) == sorted(dir(pr))
    for row in rows:
        for call in ast.walk(ast.parse(row[2].strip("`"))):
            match call:
                case ast.Call(func=ast.Attribute(value=ast.Name("pr"), attr=name)) if name[0].islower():
                    keywords = {each.arg: None for each in call.keywords if each.arg}
                    inspect.signature(getattr(pr, name)).bind(*call.args, **keywords)


def test_the_docs_have_the_limits_of_the_certificate():
    from pinnray.comparison.evaluation.certificate import (
        CONDITION_LIMIT,
        ENERGY_LIMIT,
        INTERPOLANT_LIMIT,
        WORK_LIMIT,
    )

    said = [float(row[1].split(" %")[0]) / 100 for row in table(TRUST, "fault")]
    assert said == [ENERGY_LIMIT, CONDITION_LIMIT, INTERPOLANT_LIMIT, WORK_LIMIT]


def test_the_docs_have_every_solver_with_its_loads():
    rows = table(SOLVERS, "solver")
    assert names(rows) == list(BUILT_IN)
    for name, row in zip(names(rows), rows, strict=True):
        assert re.findall(r"`(\w+)`", row[2]) == list(make_solver(name).loads), name


def test_every_solver_has_a_page_that_says_when_to_use_it_its_cost_and_its_limits():
    for name in BUILT_IN:
        text = (DOCS / "solvers" / f"{name}.md").read_text(encoding="utf-8")
        solver, traits = make_solver(name), Traits.of(make_solver(name))
        assert re.findall("^## (.+)$", text, re.MULTILINE) == ["When to use it", "Cost", "Limits"], name
        facts = dict(re.findall(r"^\| ([a-z ]+) \| (.+) \|$", text, re.MULTILINE))
        assert facts == {
            "family": traits.family,
            "laws": ", ".join(f"`{law}`" for law in solver.laws),
            "loads": ", ".join(f"`{load}`" for load in solver.loads),
            "is given the markers": "yes" if traits.assimilates else "no",
        }, name


def test_the_docs_have_every_column_of_measurements():
    from pinnray.vision.measurements import OPTIONAL, REQUIRED

    rows = table(MEASUREMENTS, "column")
    documented = [(name, row[1]) for name, row in zip(names(rows), rows, strict=True)]
    assert documented == [*((name, "yes") for name in REQUIRED), *((name, "no") for name in OPTIONAL)]


def test_the_measurements_in_the_docs_can_be_read(tmp_path):
    from pinnray.vision.measurements import read_measurements

    table, frames = [block.text for block in blocks(MEASUREMENTS) if block.language == "csv"]
    path = tmp_path / "markers.csv"
    path.write_text(frames + table, encoding="utf-8")
    observations = read_measurements(path, marker_radius=0.8)
    assert (observations.pressed.turn, observations.drawn.scale) == (3.0, 0.003)
    assert observations.label == "measured"
    assert list(observations.visible) == [True, True, False]
    np.testing.assert_allclose(observations.points, marker_positions(load_design())[:3], atol=0.005)


@pytest.mark.parametrize(
    ("page", "column", "listed"),
    [
        (FORCE, "parameter that can be found", "pinnray.solvers.identification.unknowns:DEFAULT"),
        (OWN_TRUTH, "scheme", "pinnray.studies.crossval.folds:SCHEMES"),
        (OWN_TRUTH, "truth", "pinnray.comparison.evaluation.truths:TRUTHS"),
    ],
)
def test_the_docs_have_every_name_of_a_list(page, column, listed):
    assert names(table(page, column)) == [name for name in pkgutil.resolve_name(listed) if name != "all"]


def test_the_docs_have_every_key_of_a_published_line():
    from pinnray.film.force_estimate import force_row
    from pinnray.film.live_force import frame_line
    from tests.film.test_force_estimate import FORCES, REST, frame, seen

    page = HOW_TO / "force-from-film.md"
    (example,) = (block.text for block in blocks(page) if block.language == "json")
    line = json.loads(example)
    written = frame_line(frame(0), seen(REST), REST) | {"force": force_row(FORCES[0], 1.0)}
    assert (line.keys(), line["force"].keys()) == (written.keys(), written["force"].keys())
    for heading, keys in (("key of a line", line), ("column of `force.csv`", line["force"])):
        said = {name for row in table(page, heading) for name in re.findall(r"`(\w+)`", row[0])}
        assert said == set(keys)


def test_the_docs_have_every_exit_code():
    from pinnray.runtime import exits

    codes = {int(name) for name in names(table(REFERENCE / "exit-codes.md", "code"))}
    assert codes == {0, 1, exits.BAD_INPUT, exits.NOT_CONVERGED, exits.INTERRUPTED, exits.UNREAD}


def test_the_docs_have_every_command():
    commands = {name for name in pinnray if not name.startswith("-")}
    documented = names(table(REFERENCE / "commands.md", "command"))
    said = {name.split()[-1] if "SOLVER" not in name else "solve" for name in documented}
    assert said == commands


def test_the_docs_have_every_cad_file(tmp_path):
    assert main(["design", "--out", str(tmp_path), "--formats", ",".join(CAD_FORMATS)]) == 0
    documented = names(table(OWN_FINGER, "file", after="## CAD files"))
    assert_same(documented, [path.name for path in tmp_path.iterdir()])


@pytest.mark.slow
def test_the_docs_have_every_output_file(run_folder):
    actual = [path.relative_to(run_folder).as_posix() for path in run_folder.rglob("*") if path.is_file()]
    assert_same(names(table(FILES, "file")), actual)


@pytest.mark.slow
def test_the_docs_have_every_key_of_metrics(run_folder):
    def paths(value: object, prefix: str = "") -> list[str]:
        if not isinstance(value, dict):
            return [prefix]
        return [path for key, inner in value.items() for path in paths(inner, f"{prefix}.{key}".strip("."))]

    actual = paths(json.loads((run_folder / "metrics.json").read_text(encoding="utf-8")))
    actual.remove("solvers.fem-nonlinear.certificate")  # null
    assert_same(names(table(REFERENCE / "metrics.md", "key")), actual)


@pytest.mark.slow
def test_the_docs_have_every_field(run_folder):
    import pyvista

    grid = pyvista.read(run_folder / "fields" / "fem.vtu")
    text = FILES.read_text(encoding="utf-8").partition("In the VTU files")[2].partition("\n\n")[0]
    assert set(re.findall(r"`(\w+)`", text)) == {*grid.point_data.keys(), *grid.cell_data.keys()}


@pytest.mark.slow
def test_observations_of_a_run_are_measurements(run_folder):
    with (run_folder / "observations.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    assert set(rows[0]) == {"marker", *names(table(MEASUREMENTS, "column"))}


@pytest.mark.slow
def test_runs_stand_beside_each_other_in_pandas(run_folder, tmp_path, monkeypatch):
    (tmp_path / "out").symlink_to(run_folder.parent)
    monkeypatch.chdir(tmp_path)
    run_on_results(DOCS / "report.md")


def test_the_contract_in_the_docs_is_the_one_that_is_tested():
    source = (ROOT / "tests" / "solvers" / "contract" / "test_contract.py").read_text(encoding="utf-8")
    tests = re.findall(r"^def (test_\w+)", source, re.MULTILINE)
    assert names(table(OWN_SOLVER, "test")) == [test for test in tests if "registered" not in test]
