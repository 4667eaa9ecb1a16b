"""Mutants: small changes of a module, each of which its tests should notice.

`python -m benchmarks.reliability.mutants [MODULE ...]`: a process with the libraries loaded forks for each
mutant, loads the changed module and runs the tests until one fails. A mutant is killed if one does, or if
they take too long. Docstrings, annotations, decorators and messages of errors are left alone.
"""

import ast
import copy
import csv
import gc
import importlib.abc
import importlib.machinery
import importlib.util
import os
import signal
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import CodeType
from typing import Any, NamedTuple

from geometry.atomic import write_text

ROOT = Path(__file__).parents[2]
ROWS = Path(__file__).with_name("mutants.csv")
LONGEST = 6.0
"""Longest time of the tests of a mutant, as a multiple of the time without a change."""

TESTS: Mapping[str, tuple[str, ...]] = {
    "solvers.elasticity": ("tests/solvers/test_elasticity.py",),
    "geometry.mesh.quadrature": ("tests/geometry/test_quadrature.py",),
    "compare.evaluation.metrics": ("tests/compare/test_metrics.py", "tests/compare/test_uncertainty.py"),
    "compare.evaluation.differences": ("tests/compare/test_metrics.py",),
    "solvers.assimilation.misfit": ("tests/solvers/test_assimilation.py",),
    "solvers.assimilation.marker_weighting": (
        *("tests/solvers/test_marker_weighting.py", "tests/solvers/test_assimilation.py"),
    ),
    "compare.evaluation.certificate": ("tests/compare/test_certificate_limits.py",),
    "vision.tracking.rest_detection": ("tests/vision/test_rest.py",),
    "solvers.assimilation.marker_forces": ("tests/solvers/test_marker_forces.py",),
    "solvers.assimilation.estimation": (
        *("tests/solvers/test_estimation_parts.py", "tests/solvers/test_estimation.py"),
    ),
    "vision.tracking.workspace": ("tests/vision/test_workspace_limits.py",),
    "vision.tracking.tracker": ("tests/vision/test_track.py", "tests/vision/test_track_markers.py"),
    **{
        f"vision.tracking.{name}": (f"tests/vision/test_{name}.py",)
        for name in (
            *("annotation", "camera_motion", "data_association", "fiducial_matching", "frame_means"),
            *("frame_tracker", "layout_matching", "marker_plane", "plane_fit", "scene", "trajectories"),
        )
    },
}
"""Tests by module."""

LIBRARIES = (
    *("pytest", "numpy", "scipy.optimize", "scipy.sparse.linalg", "scipy.stats", "torch", "pydantic"),
    *("cv2", "ufl", "hypothesis"),
)
"""Loaded before the forks; pytest itself loads hypothesis at the end of every run."""

OPPOSITE: Mapping[type, tuple[type, ...]] = {
    ast.Add: (ast.Sub,),
    ast.Sub: (ast.Add,),
    ast.Mult: (ast.Div,),
    ast.Div: (ast.Mult,),
    ast.Pow: (ast.Mult,),
    ast.MatMult: (ast.Mult,),
    ast.FloorDiv: (ast.Div,),
    ast.Mod: (ast.Mult,),
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
    ast.And: (ast.Or,),
    ast.Or: (ast.And,),
}


class Mutant(NamedTuple):
    """A changed module: line and words of the change."""

    line: int
    change: str
    tree: ast.Module


class Row(NamedTuple):
    """The end of a mutant, `killed` or `survived`, and a person's judgement of it."""

    module: str
    line: int
    change: str
    end: str
    judgement: str = ""


def mutants(source: str) -> Iterator[Mutant]:
    """Every mutant of a source text."""
    tree = ast.parse(source)
    _without_annotations(tree)
    places = list(_places(tree))
    for number, (node, _) in enumerate(places):
        for which, (name, _) in enumerate(_changes(node)):
            other = copy.deepcopy(tree)
            again, change = list(_places(other))[number][0], None
            change = list(_changes(again))[which][1]
            change()
            yield Mutant(node.lineno, name, ast.fix_missing_locations(other))


def _places(tree: ast.AST) -> Iterator[tuple[Any, None]]:
    """Nodes that can be changed; not those of messages of errors and of docstrings."""
    settings = getattr(tree, "decorator_list", [])
    for child in ast.iter_child_nodes(tree):
        if child in settings or isinstance(child, ast.Raise | ast.JoinedStr | ast.Import | ast.ImportFrom):
            continue
        yield from ((child, None) for _ in [0] if hasattr(child, "lineno"))
        yield from _places(child)


def _changes(node: Any) -> Iterator[tuple[str, Any]]:
    """Descriptions and functions that make the changes of a node."""
    if isinstance(node, ast.BinOp | ast.AugAssign | ast.BoolOp) and not _is_of_types(node):
        for kind in OPPOSITE.get(type(node.op), ()):
            yield (
                f"{type(node.op).__name__} to {kind.__name__}",
                lambda kind=kind: setattr(node, "op", kind()),
            )
    elif isinstance(node, ast.Compare):
        for kind in OPPOSITE.get(type(node.ops[0]), ()):
            yield (
                f"{type(node.ops[0]).__name__} to {kind.__name__}",
                lambda kind=kind: node.ops.__setitem__(0, kind()),
            )
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.Not):
        kind = ast.UAdd if isinstance(node.op, ast.USub) else None
        if kind:
            yield "minus left out", lambda: setattr(node, "op", kind())
        else:
            yield "not left out", lambda: setattr(node, "operand", ast.UnaryOp(ast.Not(), node.operand))
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
        yield f"{node.value} to {not node.value}", lambda: setattr(node, "value", not node.value)
    elif isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        yield f"{node.value} to {node.value + 1}", lambda: setattr(node, "value", node.value + 1)
    elif isinstance(node, ast.Return) and node.value is not None:
        yield "return None", lambda: setattr(node, "value", ast.Constant(None))
    elif isinstance(node, ast.If | ast.IfExp):
        yield "condition True", lambda: setattr(node, "test", ast.Constant(True))
        yield "condition False", lambda: setattr(node, "test", ast.Constant(False))


def _is_of_types(node: Any) -> bool:
    """Whether an operation makes a type, such as `float | None`."""
    return isinstance(node, ast.BinOp) and isinstance(node.op, ast.BitOr)


def _without_annotations(tree: ast.Module) -> None:
    """Leave annotations out of functions: a change of them is none."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            node.returns = None
            for argument in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs):
                argument.annotation = None


class _Changed(importlib.abc.SourceLoader):
    """Loads a module from a changed tree."""

    def __init__(self, name: str, path: str, tree: ast.Module) -> None:
        self._path, self._code = path, compile(tree, path, "exec")

    def get_filename(self, fullname: str) -> str:
        return self._path

    def get_data(self, path: str | bytes) -> bytes:
        return Path(os.fsdecode(path)).read_bytes()

    def get_code(self, fullname: str) -> CodeType:
        return self._code


class _Finder(importlib.abc.MetaPathFinder):
    """Finds one module in its changed form."""

    def __init__(self, name: str, path: str, tree: ast.Module) -> None:
        self._name, self._path, self._tree = name, path, tree

    def find_spec(
        self, fullname: str, path: Any, target: Any = None
    ) -> importlib.machinery.ModuleSpec | None:
        if fullname != self._name:
            return None
        loader = _Changed(fullname, self._path, self._tree)
        return importlib.util.spec_from_loader(fullname, loader)


def passes(module: str, tree: ast.Module, limit_s: float) -> bool:
    """Whether the tests of a module pass with another tree, in a forked process."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            os.setsid()
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, 1)
            os.dup2(nowhere, 2)
            import pytest

            sys.meta_path.insert(0, _Finder(module, str(_file(module)), tree))
            arguments = [
                "-x",
                "-q",
                "-p",
                "no:cacheprovider",
                "-m",
                "not slow",
                "--no-header",
                "-p",
                "no:xdist",
            ]
            code = int(pytest.main([*arguments, *TESTS[module]]))
        finally:
            os._exit(code)
    end = time.monotonic() + limit_s
    while time.monotonic() < end:
        pid, status = os.waitpid(child, os.WNOHANG)
        if pid:
            return os.waitstatus_to_exitcode(status) == 0
        time.sleep(0.02)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return False


def judged(module: str) -> list[Row]:
    """Run the tests of a module on each of its mutants."""
    source = _file(module).read_text(encoding="utf-8")
    started = time.monotonic()
    if not passes(module, ast.parse(source), 600):
        raise RuntimeError(f"the tests of {module} fail without a change")
    limit = LONGEST * (time.monotonic() - started) + 20
    rows = []
    for mutant in mutants(source):
        end = "survived" if passes(module, mutant.tree, limit) else "killed"
        rows.append(Row(module, mutant.line, mutant.change, end))
        if end == "survived":
            print(*rows[-1], flush=True)
    return rows


def kept_rows() -> list[Row]:
    """The mutants as they were kept."""
    if not ROWS.exists():
        return []
    with ROWS.open(encoding="utf-8", newline="") as file:
        return [Row(module, int(line), *rest) for module, line, *rest in list(csv.reader(file))[1:]]


def write_rows(rows: Sequence[Row]) -> None:
    """Keep the mutants."""
    lines = [Row._fields, *rows]
    write_text(ROWS, "".join(",".join(map(str, line)) + "\n" for line in lines))


def _file(module: str) -> Path:
    return ROOT / f"{module.replace('.', '/')}.py"


def main(modules: Sequence[str]) -> None:
    """Judge the mutants of modules, and keep the rows."""
    os.chdir(ROOT)
    for library in LIBRARIES:
        importlib.import_module(library)
    gc.freeze()  # the collections of a fork pass over what is loaded already
    for module in modules or TESTS:
        known = {
            (row.line, row.change): row.judgement
            for row in kept_rows()
            if row.module == module and row.judgement
        }
        rows = [
            row._replace(judgement=known.get((row.line, row.change), "")) if row.end == "survived" else row
            for row in judged(module)
        ]
        write_rows([*(row for row in kept_rows() if row.module != module), *rows])
        killed = sum(row.end == "killed" for row in rows)
        print(f"{module}: {killed} of {len(rows)} killed", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
