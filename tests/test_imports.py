"""The program's imports, also those inside functions and for type checkers alone, and its layers."""

import ast
import json
import re

import grimp
import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from pinnray.commands.app import COMMANDS
from tests.pinnray.commands.programs import run_python
from tests.program import ROOT, SOURCES

HEAVY = {
    *("cadquery", "cv2", "dolfinx", "gmsh", "matplotlib", "mpi4py", "mujoco", "OCP"),
    *("pandas", "petsc4py", "pyvista", "scipy", "shapely", "sklearn", "torch", "ufl", "vtk", "vtkmodules"),
}
"""Libraries that take a tenth of a second of processor to import, most of them a second."""


def test_no_modules_import_one_another_in_a_circle():
    graph = grimp.build_graph("pinnray", cache_dir=None)
    names = sorted(graph.modules)
    place = {name: number for number, name in enumerate(names)}
    pairs = [(place[a], place[b]) for a in names for b in graph.find_modules_directly_imported_by(a)]
    imports = coo_matrix((np.ones(len(pairs)), tuple(zip(*pairs, strict=True))), shape=(len(names),) * 2)
    _, circle = connected_components(imports, connection="strong")
    assert [name for name in names if np.count_nonzero(circle == circle[place[name]]) > 1] == []


def test_only_the_front_door_names_an_option_of_the_command_line():
    """Messages of the other packages speak of the concept: truth, travel, seed."""
    found, option = [], re.compile(r"(?<![\w-])--[a-z]")
    for path in SOURCES:
        if {"commands", "options"} & {*path.parts} or path.name == "cli.py":
            continue
        text = path.read_text(encoding="utf-8")
        found += [
            f"{path.relative_to(ROOT)}:{node.lineno}"
            for node in (ast.walk(ast.parse(text)) if option.search(text) else ())
            if isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and option.search(node.value)
            and not node.value.startswith("pinnray ")  # a whole command, to copy
        ]
    assert found == []


def test_quantiles_come_without_the_distributions_of_scipy():
    """scipy.stats takes a second of processor to import, and only designs are sampled by it."""
    importing = [
        path.relative_to(ROOT).as_posix()
        for path in SOURCES
        if re.search(r"^\s*(from|import) scipy\.stats", path.read_text(encoding="utf-8"), re.MULTILINE)
    ]
    assert importing == ["pinnray/studies/sweep/sampling.py"]


@pytest.mark.parametrize(
    ("command_lines", "absent"),
    [
        (["--version", "--help"], {"numpy", "pydantic", "pinnray.options.shared"}),  # nor any command
        (["compare --help"], {"numpy"}),
        ([f"{command.rpartition('.')[2]} --help" for command in COMMANDS], set()),
    ],
)
def test_help_comes_without_heavy_libraries(command_lines, absent):
    code = (
        "import json, sys\n"
        "from pinnray.cli import main\n"
        "codes = [main(line.split()) for line in json.loads(sys.argv[1])]\n"
        "json.dump([codes, sorted(sys.modules)], sys.stderr)"
    )
    done = run_python("-c", code, json.dumps(command_lines))
    codes, modules = json.loads(done.stderr)
    assert codes == [0] * len(command_lines)
    assert (HEAVY | absent) & set(modules) == set()
