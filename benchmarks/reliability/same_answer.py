"""Differences between systems in the numbers of every solver on one stored mesh.

A file of `golden/` is what `python -m tests.solvers.golden` printed on another system; in the container:
`buildah run -v $PWD:/src:ro CONTAINER -- sh -c "cd /src; PYTHONPATH=/src python -m tests.solvers.golden"`.
"""

import json
from pathlib import Path
from typing import Any, NamedTuple

from tests.solvers.golden import NUMBERS

KEPT = Path(__file__).with_name("golden")


class System(NamedTuple):
    """A system, and for each job the largest relative difference from the stored numbers."""

    versions: dict[str, str]
    differences: dict[str, float]


def stored_on() -> dict[str, str]:
    """Versions of the system that the stored numbers are of."""
    return dict(_read(NUMBERS)["system"])


def systems() -> list[System]:
    """The other systems, by the names of their files."""
    stored = _read(NUMBERS)["jobs"]
    return [
        System(
            found["system"],
            {
                name: max(abs(found["jobs"][name][key] / value - 1) for key, value in numbers.items())
                for name, numbers in stored.items()
            },
        )
        for found in map(_read, sorted(KEPT.glob("*.json")))
    ]


def _read(path: Path) -> Any:
    return json.loads(path.read_text(encoding="utf-8"))
