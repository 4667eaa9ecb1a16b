"""Python programs that tests start in processes of their own."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]

COMMAND = "import sys; from pinnray.cli import main; sys.exit(main(sys.argv[1:]))"

WITHOUT_PICTURES = (
    f"import pinnray.comparison.pipeline.pipeline as p; p.draw_all = lambda *_, **__: []; {COMMAND}"
)
"""Pictures take most of the time of a small comparison, and have tests of their own."""


FEW_ELEMENTS = "from pinnray.geometry.cache import finger_mesh as f; f.__kwdefaults__['across'] = 1; "
"""Goes before one of these, as the fixture `few_elements`."""


def run_python(
    *arguments: str, before: str = "", after: str = "", **environment: str
) -> subprocess.CompletedProcess[str]:
    """Run Python with arguments by a shell, with words before and after the line, where the packages are."""
    return subprocess.run(
        ["bash", "-c", f'{before} "$0" "$@" {after}', sys.executable, *arguments],
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
        capture_output=True,
        text=True,
        check=False,
    )
