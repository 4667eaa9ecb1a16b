"""The approved refusals: inputs that a user may give, each with the one line that refuses it.

`approved.txt` has a section for each module of this folder, and in it an input and its line:

    == geometry ==
    >>> Design(height=9999)
    height (H) = 9999 mm is outside its range, 10 to 500 mm
    $ compare --solvers fen
    no solver is called 'fen'; did you mean 'fem'? ...

An input after `>>>` is a Python expression of the names in the section's module; one after `$` is a line for
`pinnray`. Both run in an empty folder with the files of the module's dictionary `FILES`. `...` in a line
stands for any text, where it depends on the machine. `python -m tests.refusals.runner` runs all inputs and
writes their lines anew: read the difference before you commit it.
"""

import contextlib
import importlib
import io
import os
import re
import shlex
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from pinnray.runtime.errors import UserError
from pinnray.runtime.exits import BAD_INPUT

APPROVED = Path(__file__).with_name("approved.txt")
SECTION, PYTHON, SHELL = "== ", ">>> ", "$ "


@dataclass(frozen=True)
class Refusal:
    """An input of a section, and the line that refuses it; without one, an input that is not approved yet."""

    section: str
    given: str
    line: str = ""

    def matches(self, line: str) -> bool:
        """Whether a line is the approved one, of which `...` is any text."""
        pattern = ".*".join(map(re.escape, self.line.split("...")))
        return re.fullmatch(pattern, line) is not None


def read() -> list[str | Refusal]:
    """The approved text: refusals, and the lines between them as they stand."""
    parts: list[str | Refusal] = []
    section = ""
    for line in APPROVED.read_text(encoding="utf-8").splitlines():
        if line.startswith((PYTHON, SHELL)):
            parts.append(Refusal(section, line))
        elif parts and isinstance(last := parts[-1], Refusal) and not last.line and line:
            parts[-1] = replace(last, line=line)
        else:
            parts.append(line)
            if line.startswith(SECTION):
                section = line.strip("= ")
    return parts


def refusals() -> list[Refusal]:
    """The approved refusals in their order."""
    return [part for part in read() if isinstance(part, Refusal)]


def refused(refusal: Refusal, folder: Path) -> str:
    """Run an input in an empty folder and return its one line.

    Raises:
        AssertionError: If it is not refused by one line, or a command writes a file or names nothing of it.
    """
    module = importlib.import_module(f"tests.refusals.{refusal.section}")
    _write(getattr(module, "FILES", {}), folder)
    with contextlib.chdir(folder):
        before = _contents(folder)
        if refusal.given.startswith(SHELL):
            line = _of_command(refusal.given.removeprefix(SHELL))
            assert _contents(folder) == before, "a refused command leaves the folder as it was"
        else:
            line = _of_expression(refusal.given.removeprefix(PYTHON), vars(module))
    assert line.strip(), "a refusal has a message"
    assert "\n" not in line, "a refusal is one line"
    return line.replace(f"{folder}/", "")


def _of_expression(expression: str, names: Mapping[str, object]) -> str:
    try:
        eval(expression, dict(names))
    except UserError as error:
        return str(error)
    raise AssertionError(f"not refused: {expression}")


def _of_command(line: str) -> str:
    from pinnray.cli import main

    words, out, error = shlex.split(line), io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
        code = main(words)
    assert code == BAD_INPUT, f"exit code {code}: {error.getvalue()}"
    assert out.getvalue() == "", "standard output is empty"
    (said,) = error.getvalue().splitlines()
    assert said.startswith("error: ")
    said = said.removeprefix("error: ")
    parts = [part.removesuffix("s") for word in words for part in re.split(r"[-=,.;/_\s]", word) if part]
    assert any(part.lower() in said.lower() for part in [*words, *parts]), (
        f"it names no option, value or file: {said}"
    )
    return said


def _write(files: Mapping[str, str | bytes], folder: Path) -> None:
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())


def _contents(folder: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() if path.is_file() else b"" for path in folder.rglob("*")}


def main() -> None:
    """Run all inputs, or those of the sections that are named, and write their lines."""
    parts = read()
    for number, part in enumerate(parts):
        if isinstance(part, Refusal) and (not sys.argv[1:] or part.section in sys.argv[1:]):
            try:
                with tempfile.TemporaryDirectory() as folder:
                    line = refused(part, Path(folder))
            except AssertionError as error:
                print(f"{part.given}\n    {error}", file=sys.stderr)
                continue
            if not part.matches(line):
                parts[number] = replace(part, line=line)
    texts = [part if isinstance(part, str) else f"{part.given}\n{part.line}" for part in parts]
    APPROVED.write_text("\n".join(texts) + "\n", encoding="utf-8")


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    main()
