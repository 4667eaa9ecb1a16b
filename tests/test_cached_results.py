"""Every module that a result in a cache or a resumable folder depends on counts in its key."""

import ast
from functools import cache

import grimp
import pytest

from pinnray.runtime.content_hash import packages_behind
from tests.program import SOURCES, module_name

DIGESTS = ("sources_digest", "job.definition")


@pytest.fixture(scope="module")
def imports() -> grimp.ImportGraph:
    """The imports of the program, also those inside functions."""
    return grimp.build_graph("pinnray", exclude_type_checking_imports=True, cache_dir=None)


@cache
def keyed_modules() -> list[str]:
    """Modules that put their own name into the key of a result."""
    found = []
    for path in SOURCES:
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if "__name__" in text else ():
            digest = isinstance(node, ast.Call) and ast.unparse(node.func) in DIGESTS
            if digest and any(ast.unparse(argument) == "__name__" for argument in node.args):  # type: ignore[attr-defined]
                found.append(module_name(path))
    return found


def test_every_kind_of_cached_result_has_a_key():
    assert {module.rpartition(".")[0] for module in keyed_modules()} == {
        "pinnray.geometry",  # meshes, CAD, drawings
        "pinnray.comparison.evaluation",  # simulated truths
        "pinnray.comparison.pipeline",  # solutions that a resumed run takes over
        "pinnray.studies.crossval",  # truths, folds
        "pinnray.studies.sweep",
        "pinnray.studies.emulator",
        "pinnray.studies.fields",
        "pinnray.studies.optimum",
        "pinnray.studies.benchmark",  # published numbers
    }


@pytest.mark.parametrize("module", keyed_modules())
def test_all_that_a_cached_result_imports_is_in_its_digest(imports, module):
    """The digest looks for imports as text; the import graph has them from the syntax tree."""
    needed = imports.find_upstream_modules(module)
    assert len(needed) > 20
    covered = {place.name for place in packages_behind(module)}
    assert {each.split(".")[1] for each in needed if "." in each} - covered == set()
