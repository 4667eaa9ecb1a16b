"""Lazy exports of a package: each name is loaded from its module on first use."""

import ast
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any


def lazy_exports(package: str, file: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """`__getattr__`, `__dir__` and `__all__` of a package, read from the imports in its `__init__.py`.

    Imports of the form `from module import name as name` under `TYPE_CHECKING` are exports; type checkers
    read the same lines. Source: Scientific Python SPEC 1, whose `lazy_loader.attach_stub` reads a stub file.

    Args:
        package: `__name__` of the package.
        file: Its `__file__`.
    """
    homes = {
        alias.name: str(node.module)
        for node in ast.walk(ast.parse(Path(file).read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.asname == alias.name
    }

    def load(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(homes[name]), name)

    names = sorted(homes)
    return load, lambda: names, names
