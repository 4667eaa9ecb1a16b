"""The program's sources: those of pinnray/, and of the folders beside it that its links lead to."""

from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "pinnray"

ROOMS = [place for place in sorted(PACKAGE.iterdir()) if place.is_dir() and place.name != "__pycache__"]

SOURCES = sorted([*PACKAGE.glob("*.py"), *(path for room in ROOMS for path in room.rglob("*.py"))])
"""Every module of the program, by the path that its import name has."""


def module_name(path: Path) -> str:
    """The import name of a source."""
    return ".".join(path.relative_to(ROOT).with_suffix("").parts)
