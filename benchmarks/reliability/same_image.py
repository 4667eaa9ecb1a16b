"""Files of two builds of the image, by content: which are the same to the bit, and which are not.

`python -m benchmarks.reliability.same_image FOLDER FOLDER` keeps the counts; `.ci/image-twice` builds the
images and gives their folders.
"""

import json
import sys
from pathlib import Path
from typing import NamedTuple

from geometry.atomic import write_text
from geometry.content_hash import file_digest

KEPT = Path(__file__).with_name("same_image.json")


class Comparison(NamedTuple):
    """Number of files, those that only one build has, and those whose contents differ, by their paths."""

    files: int
    lone: list[str]
    differ: list[str]


def compared(first: Path, second: Path) -> Comparison:
    """Compare the regular files and the targets of the links of two folders."""
    one, other = _contents(first), _contents(second)
    both = one.keys() & other.keys()
    return Comparison(
        len(one | other),
        sorted(one.keys() ^ other.keys()),
        sorted(name for name in both if one[name] != other[name]),
    )


def kept() -> Comparison | None:
    """The comparison as it was kept."""
    return Comparison(**json.loads(KEPT.read_text(encoding="utf-8"))) if KEPT.exists() else None


def _contents(folder: Path) -> dict[str, str]:
    found = {}
    for path in folder.rglob("*"):
        if path.is_symlink():
            found[path.relative_to(folder).as_posix()] = f"link to {path.readlink()}"
        elif path.is_file():
            found[path.relative_to(folder).as_posix()] = file_digest(path)
    return found


def main(first: str, second: str) -> None:
    """Compare two folders and keep what was found."""
    found = compared(Path(first), Path(second))
    write_text(KEPT, json.dumps(found._asdict(), indent=1) + "\n")
    print(f"{found.files} files, {len(found.lone)} in one build only, {len(found.differ)} differ")


if __name__ == "__main__":
    main(*sys.argv[1:])
