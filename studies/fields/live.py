"""The explorer with a solver behind it: a server for this machine alone.

The page is the one that `explorer` writes, and Python's own server sends it: a framework of widgets (trame,
Panel, NiceGUI) would need the page a second time, in its own words. Whatever the browser asks for must carry
the page's secret, so that no other site that is open in the browser can start computations.
"""

import json
from collections.abc import Callable, Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from secrets import compare_digest, token_urlsafe
from tempfile import TemporaryDirectory
from threading import Lock
from typing import Any

from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.parameters import Parameters
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.runtime.errors import UserError
from pinnray.runtime.processes.child import ProcessFailed
from pinnray.runtime.processes.pool import Pool
from pinnray.studies.fields.emulator import FieldEmulator, grip_force
from pinnray.studies.fields.explorer import write_explorer
from pinnray.studies.fields.reader import FIGURES
from pinnray.studies.sweep.field_path import FieldPath, moved_mesh
from pinnray.studies.sweep.job import FieldOrder, Task, field_base
from pinnray.studies.sweep.measurement import Measurement, measured
from pinnray.studies.sweep.study import PHYSICS, physics_of

HOST = "127.0.0.1"
TIME_LIMIT_S = 300.0
"""Longest time for a solution."""

LARGEST_QUESTION = 10_000
"""Bytes of a question at most."""


def serve_explorer(emulator: FieldEmulator, port: int, started: Callable[[str], None]) -> None:
    """Serve the explorer until it is interrupted.

    Args:
        emulator: Of the study's fields.
        port: Of this machine; 0 takes any that is free.
        started: Called with the address.

    Raises:
        UserError: If the port is taken.
    """
    with TemporaryDirectory(prefix="pinnray-app-") as folder, Pool(1) as pool:
        secret = token_urlsafe(24)
        page = write_explorer(emulator, Path(folder) / "explore.html", live=secret).read_bytes()
        live = LiveSolver(emulator, Path(folder), pool)
        try:
            server = ThreadingHTTPServer((HOST, port), handler(page, secret, live.answer))
        except OSError as error:
            raise UserError(f"port {port}: {error.strerror}; take another one, or 0 for any") from None
        started(f"http://{HOST}:{server.server_port}/")
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            pass
        finally:
            server.server_close()


class LiveSolver:
    """Solves what the page asks, one question after another.

    Args:
        emulator: Whose mesh and study the questions are of.
        folder: For fields.
        pool: Of one process.
    """

    def __init__(self, emulator: FieldEmulator, folder: Path, pool: Pool) -> None:
        self._emulator, self._file, self._pool, self._lock = emulator, folder / "field.npz", pool, Lock()

    def answer(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """What the finger does at the values of the sliders.

        Args:
            values: Stroke and every varied parameter, by name; those of a design, the material and the load.

        Returns:
            `message`, and where there is a solution `points` and `nodal` displacements of the nodes, `stress`
            at them, `figures` by name, and `forces` at equal strokes up to the full one, in the page's units.
        """
        with self._lock:
            task = self._task(values)
            (found,) = (
                answer for _, answer in self._pool.answers(solved_task, {0: task}, timeout_s=TIME_LIMIT_S)
            )
            if isinstance(found, ProcessFailed):
                return {"message": f"no answer within {TIME_LIMIT_S:g} s; {found.message}"}
            if found.state != "done":
                return {"message": found.message}
            return {"message": found.message, **self._read(task)}

    def _task(self, values: Mapping[str, Any]) -> Task:
        emulator = self._emulator
        study = emulator.study
        given = {**study.fixed, **{name: float(value) for name, value in values.items()}}
        shape = {name: value for name, value in given.items() if name in Parameters.model_fields}
        base = field_base(study, emulator.inputs.base)
        return Task(
            0,
            {**emulator.inputs.base, **shape, "name": study.name},
            MeshSettings(size=study.mesh_size),
            {name: value for name, value in given.items() if name in PHYSICS},
            study.solver,
            dict(study.settings),
            study.density,
            fields=FieldOrder(self._file, len(emulator.shares), json.dumps(base)),
        )

    def _read(self, task: Task) -> dict[str, Any]:
        emulator, path = self._emulator, FieldPath.load(self._file)
        finger = Design(**task.definition)
        material, load = physics_of(task.physics)
        points = (
            moved_mesh(task.fields.base, task.mesh).of(finger).points if task.fields else emulator.mesh.points
        )
        nodal = path.nodal[-1]
        forces = [grip_force(numbers[:2], load) * finger.depth for numbers in path.numbers]
        law = material.model_copy(update={"law": emulator.law})
        stress = emulator.reader.stress(points, nodal, emulator.law, law.lame)
        read = emulator.reader.figures(points, nodal, stress, finger.contact_abscissa)
        values = (forces[-1], *read, float(path.numbers[-1, 4]))
        return {
            "points": points.ravel().tolist(),
            "nodal": nodal.ravel().tolist(),
            "stress": stress.tolist(),
            "figures": dict(zip(FIGURES, map(float, values), strict=True)),
            "forces": forces,
        }


def solved_task(task: Task, report: Callable[..., None]) -> Measurement:
    """The work of the child process."""
    return measured(task)


def handler(
    page: bytes, secret: str, answer: Callable[[Mapping[str, Any]], dict[str, Any]]
) -> type[BaseHTTPRequestHandler]:
    """Handles the two questions of a browser: the page, and a solution.

    Args:
        page: The explorer.
        secret: That a question for a solution must carry.
        answer: Solves; what it raises as a `UserError` becomes the answer's message.
    """

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            if self._is_local():
                known = self.path == "/"
                self._send(
                    HTTPStatus.OK if known else HTTPStatus.NOT_FOUND, page if known else b"", "text/html"
                )

        def do_POST(self) -> None:
            if not self._is_local():
                return
            if self.path != "/solve" or not compare_digest(self.headers.get("X-Pinnray", ""), secret):
                self._send(HTTPStatus.FORBIDDEN, b"", "text/plain")
                return
            length = int(self.headers.get("Content-Length") or 0)
            try:
                if not 0 < length <= LARGEST_QUESTION:
                    raise ValueError("its length")
                values = json.loads(self.rfile.read(length))
                found = answer({str(name): float(value) for name, value in values.items()})
            except UserError as error:
                found = {"message": str(error)}
            except (ValueError, TypeError, AttributeError):
                self._send(HTTPStatus.BAD_REQUEST, b"", "text/plain")
                return
            self._send(HTTPStatus.OK, json.dumps(found).encode(), "application/json")

        def _is_local(self) -> bool:
            """Refuse what was sent to another name, such as a site's that has been made to lead here."""
            name = self.headers.get("Host", "").rpartition(":")[0]
            if name not in (HOST, "localhost"):
                self._send(HTTPStatus.FORBIDDEN, b"", "text/plain")
            return name in (HOST, "localhost")

        def _send(self, status: HTTPStatus, content: bytes, kind: str) -> None:
            self.send_response(status)
            self.send_header("Content-Type", f"{kind}; charset=utf-8")
            self.send_header("Content-Length", str(len(content)))
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, format: str, *args: object) -> None:
            """Say nothing: the terminal has the address alone."""

    return Handler
