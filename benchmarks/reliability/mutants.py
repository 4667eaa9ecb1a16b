"""Mutants of a module by mutmut: small changes, each of which a test should notice.

`python -m benchmarks.reliability.mutants MODULE TEST ...`, such as `compare.evaluation.metrics
tests/compare/evaluation/test_metrics.py`; `pip install 'pinn-ray[bench]'` brings mutmut. It
works on a copy of the tree,
and forks a process that has loaded the tests for each mutant. Prints the share that tests kill, and the
survivors. The rows of `mutants.csv` are of a tool of commit 2d22adb, judged by a person.
"""

import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
ROWS = Path(__file__).with_name("mutants.csv")
PACKAGES = sorted(path.parent.name for path in ROOT.glob("*/__init__.py"))


class Row(NamedTuple):
    """The end of a mutant, `killed` or `survived`, and a person's judgement of it."""

    module: str
    line: int
    change: str
    end: str
    judgement: str


def main(module: str, tests: Sequence[str]) -> None:
    """Run tests on each mutant of a module.

    Raises:
        CalledProcessError: If mutmut is missing, or the tests fail without a change.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for package in PACKAGES:
            shutil.copytree(ROOT / package, folder / package, ignore=shutil.ignore_patterns("__pycache__"))
        text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
        (folder / "pyproject.toml").write_text(text + settings(module, tests), encoding="utf-8")
        mutmut(folder, "run")
        ends = dict(re.findall(r"^\s*(\S+): (.+)$", mutmut(folder, "results", "--all", "true"), re.MULTILINE))
        for mutant in (mutant for mutant, end in ends.items() if end == "survived"):
            print(mutant, *re.findall(r"^[-+] .*", mutmut(folder, "show", mutant), re.MULTILINE), sep="\n")
    counts = Counter(ends.values())
    print(*(f"{number} {end}" for end, number in counts.items()), sep=", ")
    print(f"{module}: {100 * counts['killed'] / len(ends):.0f} % of {len(ends)} killed")


def settings(module: str, tests: Sequence[str]) -> str:
    """The table of mutmut in pyproject.toml."""
    sources = [package for package in PACKAGES if package not in ("tests", "benchmarks")]
    return f"""
[tool.mutmut]
source_paths = {[f"{source}/" for source in sources]}
only_mutate = ["{module.replace(".", "/")}.py"]
also_copy = ["benchmarks/"]
pytest_add_cli_args_test_selection = {list(tests)}
pytest_add_cli_args = ["-m", "not slow", "-p", "no:xdist"]
process_isolation = "forkserver"
"""


def mutmut(folder: Path, *arguments: str) -> str:
    """The output of a command of mutmut."""
    command = [sys.executable, "-m", "mutmut", *arguments]
    return subprocess.run(command, cwd=folder, check=True, stdout=subprocess.PIPE, text=True).stdout


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
