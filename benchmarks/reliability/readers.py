"""The readers of files that people give, each with files to start from."""

import importlib
import json
import os
import signal
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing import Pipe
from pathlib import Path
from typing import Any

from geometry.errors import UserError

ROOT = Path(__file__).parents[2]
DATA = ROOT / "tests" / "data"
LONGEST_S = 10
"""Time that one file may take, s."""


@dataclass(frozen=True)
class Reader:
    """A reader of one kind of file.

    Attributes:
        suffix: Of its files.
        read: Reads a file.
        seeds: Makes the contents of good files.
        modules: Modules whose branches guide the fuzzing; none if files are changed at random.
        longest: Largest file that is tried, bytes.
        allowed: Exceptions that its callers turn into a line, besides `UserError`.
    """

    suffix: str
    read: Callable[[Path], Any]
    seeds: Callable[[], list[bytes]]
    modules: tuple[str, ...]
    longest: int = 4096
    allowed: tuple[type[Exception], ...] = ()

    def try_file(self, path: Path) -> bool:
        """Whether the file can be read; a refusal in one line is right, too.

        Raises:
            ValueError: If the refusal has several lines, or none.
            Exception: If the reader has a fault.
        """
        try:
            self.read(path)
        except self.allowed:
            return False
        except UserError as error:
            if not str(error).strip() or "\n" in str(error):
                raise ValueError(f"no single line: {str(error)!r}") from error
            return False
        return True


def _design(path: Path) -> Any:
    """A design, without the ranges that a refusal proposes, for which it tries a thousand others."""
    from geometry.finger import presets, validation

    validation._ranges = lambda *_: []
    return presets.load_design(path)


def _study(path: Path) -> Any:
    from compare.sweep.study import load_study

    return load_study(path)


def _options(path: Path) -> Any:
    from compare.commands.options_file import read_options_file

    return read_options_file(path)


def _description(path: Path) -> Any:
    from geometry.drawing.description import load_description

    return load_description(path)


def _measurements(path: Path) -> Any:
    from vision.measurements import read_measurements

    return read_measurements(path, marker_radius=0.8)


def _camera(path: Path) -> Any:
    from vision.calibration.camera_file import load_camera

    return load_camera(path)


def _workspace(path: Path) -> Any:
    from vision.tracking.workspace import load_workspace

    return load_workspace(path)


class EndedError(Exception):
    """A C library ended the process that read a file."""


class ForkedReader:
    """Reads files with a module's function in a forked process, and in a new one after it has ended."""

    def __init__(self, module: str, name: str) -> None:
        self._module, self._name, self._child = module, name, 0

    def __call__(self, path: Path) -> None:
        """Read a file.

        Raises:
            EndedError: If the process ended, or took longer than `LONGEST_S`.
            Exception: What the reader raised, which the process passes on.
        """
        if not self._child:
            self._start()
        self._ours.send(path)
        if self._ours.poll(LONGEST_S):
            try:
                error = self._ours.recv()
            except (EOFError, OSError):
                self._end()
                raise EndedError from None
            if error is not None:
                raise error
            return
        self._end()
        raise EndedError

    def _start(self) -> None:
        read = getattr(importlib.import_module(self._module), self._name)  # here: once
        self._ours, theirs = Pipe()
        self._child = os.fork()
        if self._child:
            theirs.close()
            return
        for number in range(1, signal.NSIG):
            if number not in (signal.SIGKILL, signal.SIGSTOP) and signal.getsignal(number) is not None:
                signal.signal(number, signal.SIG_DFL)  # the fuzzer's own would look at the crash
        while True:
            try:
                read(theirs.recv())
                theirs.send(None)
            except EOFError:
                os._exit(0)
            except Exception as error:
                theirs.send(error)

    def _end(self) -> None:
        os.kill(self._child, signal.SIGKILL)
        os.waitpid(self._child, 0)
        self._ours.close()
        self._child = 0


_mesh = ForkedReader("geometry.drawing.formats.msh", "read_msh")


def _svg(path: Path) -> Any:
    from geometry.drawing.formats.svg import read_svg

    return read_svg(path)


def _dxf(path: Path) -> Any:
    from geometry.drawing.formats.dxf import read_dxf

    return read_dxf(path)


def _picture(path: Path) -> Any:
    from vision.frames.pictures import images_of_files

    return list(images_of_files([path], 30.0))


def _video(path: Path) -> Any:
    from vision.frames.video import video_frames

    return sum(1 for _ in video_frames(path))


def _cached_mesh(path: Path) -> Any:
    from geometry.mesh.triangle_mesh import TriangleMesh

    return TriangleMesh.load(path)


def _checkpoint(path: Path) -> Any:
    from solvers.pinn.paper import checkpoint

    checkpoint.FILE = path.name
    return checkpoint.load_checkpoint(path.parent, "digest")


def _texts(*patterns: str) -> Callable[[], list[bytes]]:
    return lambda: [path.read_bytes() for pattern in patterns for path in sorted(ROOT.glob(pattern))]


def _written(suffix: str, write: Callable[[Path], object]) -> Callable[[], list[bytes]]:
    """The content that a function writes into a file."""

    def contents() -> list[bytes]:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"seed{suffix}"
            write(path)
            return [path.read_bytes()]

    return contents


def _write_camera(path: Path) -> None:
    from vision.calibration.camera import Camera
    from vision.calibration.camera_file import save_camera

    save_camera(path, Camera(640, 480, 600.0, 600.0, 320.0, 240.0, (0.1, 0.0, 0.0, 0.0, 0.0)))


def _write_workspace(path: Path) -> None:
    from geometry.finger.design import Design
    from vision.tracking.workspace import default_workspace

    path.write_text(json.dumps(default_workspace(Design()).model_dump(mode="json")))


def _write_triangles(path: Path) -> None:
    _square().save(path)


def _square() -> Any:
    import numpy as np

    from geometry.mesh.triangle_mesh import TriangleMesh

    return TriangleMesh(
        points=np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]),
        triangles=np.array([[0, 1, 2], [0, 2, 3]]),
        boundaries={"base": np.array([[3, 0]]), "contact": np.array([[2, 3]]), "front": np.array([[2, 3]])},
        marker_nodes=np.array([2]),
        contact_node=3,
        depth=1.0,
    )


def _write_gmsh(version: float, *, binary: bool = False) -> Callable[[Path], None]:
    """Writes a mesh with physical groups in a version of the format."""

    def write(path: Path) -> None:
        import gmsh

        from geometry.mesh.gmsh_model import session

        with session():
            gmsh.model.occ.addRectangle(0, -10, 0, 30, 10)
            gmsh.model.occ.synchronize()
            for tag, name in ((4, "base"), (3, "contact")):
                gmsh.model.addPhysicalGroup(1, [tag], name=name)
            gmsh.model.addPhysicalGroup(2, [1], name="body")
            gmsh.option.setNumber("Mesh.MeshSizeMin", 20)
            gmsh.model.mesh.generate(2)
            gmsh.option.setNumber("Mesh.MshFileVersion", version)
            gmsh.option.setNumber("Mesh.Binary", binary)
            gmsh.write(str(path))

    return write


def _write_dxf(path: Path) -> None:
    import ezdxf

    document = ezdxf.new("R12")
    space = document.modelspace()
    space.add_line((0, 0), (30, 0))
    space.add_line((30, 0), (0, -10))
    space.add_line((0, -10), (0, 0))
    space.add_circle((5, -2), 1)
    document.saveas(path)


def _write_video(path: Path) -> None:
    import numpy as np

    from vision.frames.video import video_writer

    with video_writer(path, (16, 16), 30.0) as write:
        for level in range(3):
            write(np.full((16, 16, 3), 60 * level, np.uint8))


def _encoded(*suffixes: str) -> Callable[[], list[bytes]]:
    def contents() -> list[bytes]:
        import cv2
        import numpy as np

        image = np.arange(8 * 8 * 3, dtype=np.uint8).reshape(8, 8, 3)
        return [cv2.imencode(suffix, image)[1].tobytes() for suffix in suffixes]

    return contents


def _write_checkpoint(path: Path) -> None:
    import torch
    from safetensors.torch import save_file

    save_file({"weights": torch.arange(6.0), "epoch": torch.tensor(3)}, path, {"digest": "digest"})


def _many(*makers: Callable[[], list[bytes]]) -> Callable[[], list[bytes]]:
    return lambda: [content for maker in makers for content in maker()]


CSV = b"# simulated\nmarker,x_mm,y_mm,u_mm,v_mm,std_u_mm,std_v_mm,visible\n1,1,-1,0,-.5,.1,.1,1\n"
SVG = (
    b'<svg width="30mm" height="10mm" viewBox="0 0 30 10"><path d="M0 0H30L0 10Z"/>'
    b'<circle cx="5" cy="3" r="1"/></svg>'
)
SVG_USE = b'<svg><g id="a" transform="scale(2)"><use href="#a"/><rect width="9" height="3" rx="1"/></g></svg>'
OPTIONS = b'[options]\nmesh-size = 0.5\nset = ["rib_count=6"]\n'
SWEEP = b'samples = 4\nsampling = "sobol"\n[fixed]\nyoung = 3\n[varied]\nrib_angle = {from = -10, to = 20}\n'
DAMAGED: tuple[type[Exception], ...] = (Exception,)
"""What readers of the program's own cache may raise: their callers make the file again."""

READERS = {
    "design": Reader(
        ".toml", _design, _texts("geometry/designs/*.toml"), ("geometry.finger", "geometry.text_files")
    ),
    "study": Reader(".toml", _study, lambda: [SWEEP], ("compare.sweep.study", "geometry.text_files")),
    "options": Reader(
        ".toml", _options, lambda: [OPTIONS], ("compare.commands.options_file", "geometry.text_files")
    ),
    "description": Reader(
        ".toml",
        _description,
        _texts("tests/data/**/*.toml"),
        ("geometry.drawing.description", "geometry.text_files"),
    ),
    "measurements": Reader(
        ".csv", _measurements, lambda: [CSV], ("vision.measurements", "geometry.observations")
    ),
    "camera": Reader(
        ".json",
        _camera,
        _many(_written(".json", _write_camera), _written(".yml", _write_camera)),
        ("vision.calibration.camera_file", "vision.calibration.camera"),
    ),
    "workspace": Reader(
        ".json",
        _workspace,
        _written(".json", _write_workspace),
        ("vision.tracking.workspace", "geometry.text_files"),
    ),
    "svg": Reader(".svg", _svg, lambda: [SVG, SVG_USE], ("geometry.drawing",)),
    "dxf": Reader(".dxf", _dxf, _written(".dxf", _write_dxf), ("geometry.drawing",), longest=32768),
    "msh": Reader(
        ".msh",
        _mesh,
        _many(
            *(_written(".msh", _write_gmsh(version)) for version in (4.1, 4.0, 2.2)),
            *(_written(".msh", _write_gmsh(version, binary=True)) for version in (4.1, 2.2)),
        ),
        (),  # another process would have to tell its branches
    ),
    "picture": Reader(
        ".png", _picture, _encoded(".png", ".jpg", ".tif", ".bmp", ".ppm", ".webp"), ("vision.frames",)
    ),
    "video": Reader(
        ".mkv",
        _video,
        _many(*(_written(suffix, _write_video) for suffix in (".mkv", ".avi", ".mp4"))),
        ("vision.frames",),
        longest=16384,
    ),
    "mesh archive": Reader(
        ".npz",
        _cached_mesh,
        _written(".npz", _write_triangles),
        ("geometry.mesh", "numpy.lib"),
        allowed=DAMAGED,
    ),
    "checkpoint": Reader(
        ".safetensors",
        _checkpoint,
        _written(".safetensors", _write_checkpoint),
        ("solvers.pinn.paper.checkpoint",),
    ),
}
"""By name."""
