"""The child process for CAD and meshing, so that a hang or a crash can be ended and reported.

`python -m geometry.worker` reads one task as JSON from standard input and answers with one line of JSON.
"""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from geometry.errors import UserError

FOREIGN_PREFIXES = ("OMPI_", "PMIX_", "PMI_", "PRTE_", "I_MPI_", "MPI_", "HYDRA_", "MPIEXEC_")
"""Environment variables that would make the child a member of the parent's MPI run."""

EXIT_REFUSED = 2
EXTRA_SECONDS = 5


def run_task(task: Mapping[str, Any], timeout_s: float) -> None:
    """Run a task in a child process and wait for it.

    Args:
        task: Argument of `perform`, with `what` as its description in messages.
        timeout_s: Time limit, s.

    Raises:
        UserError: One line, if the task fails or takes too long.
    """
    process = subprocess.Popen(
        [sys.executable, "-m", "geometry.worker"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=child_environment(os.environ),
    )
    try:
        answer, errors = process.communicate(json.dumps({**task, "timeout_s": timeout_s}), timeout=timeout_s)
    except BaseException as error:  # a time-out, or Ctrl-C: leave no process behind
        process.kill()
        process.communicate()
        if isinstance(error, subprocess.TimeoutExpired):
            raise UserError(
                f"{task['what']} was ended after {timeout_s:g} s; use larger elements, or allow more time"
            ) from None
        raise
    if process.returncode == EXIT_REFUSED:
        raise UserError(json.loads(answer)["error"])
    if process.returncode != 0:
        last = errors.strip().splitlines()[-1:] or ["it left no message"]
        raise UserError(f"{task['what']} failed (exit code {process.returncode}): {last[0]}")


def child_environment(environment: Mapping[str, str]) -> dict[str, str]:
    """The environment without MPI's variables and with this package on the path."""
    kept = {name: value for name, value in environment.items() if not name.startswith(FOREIGN_PREFIXES)}
    root = str(Path(__file__).resolve().parent.parent)
    kept["PYTHONPATH"] = os.pathsep.join(filter(None, [root, kept.get("PYTHONPATH", "")]))
    return kept


def perform(task: Mapping[str, Any]) -> None:
    """Run a task in this process.

    Args:
        task: `kind` ("mesh" or "cad"), `finger` as its definition and `output` as a path; for a mesh also
            `settings` as a dictionary, for CAD `formats`.
    """
    from geometry.finger.design import Design

    finger = Design(**task["finger"])
    output = Path(task["output"])
    if task["kind"] == "mesh":
        from geometry.mesh.mesher import build_mesh
        from geometry.mesh.settings import MeshSettings

        build_mesh(finger, MeshSettings(**task["settings"])).save(output)
    elif task["kind"] == "cad":
        from geometry.cad import write_archive

        write_archive(finger, task["formats"], output)
    else:
        raise UserError(f"unknown task {task['kind']!r}; there are 'mesh' and 'cad'")


def main() -> int:
    """Read a task, run it, and answer."""
    task = json.load(sys.stdin)
    if hasattr(signal, "alarm"):  # ends this process if the parent was killed and Gmsh hangs
        signal.alarm(int(task["timeout_s"]) + EXTRA_SECONDS)
    try:
        perform(task)
    except UserError as error:
        json.dump({"error": str(error)}, sys.stdout)
        return EXIT_REFUSED
    return 0


if __name__ == "__main__":
    sys.exit(main())
