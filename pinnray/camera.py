"""Functions of the front door for experimenters: calibrate, track, force from a film, and the virtual rig."""

import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from pinnray.arguments import MATERIAL, learned_of, mesh_settings, read_finger, read_job, read_solver, taken
from pinnray.film.film import FilmSettings
from pinnray.film.rig_settings import RigSettings
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.observations import Observations
from pinnray.measurements import load_measurements
from pinnray.runtime.text_files import as_path, output_folder
from pinnray.solvers.load import Load, LoadKind
from pinnray.solvers.material import Material
from pinnray.solvers.solver import Solver

if TYPE_CHECKING:
    import pandas as pd

    from pinnray.vision.calibration.camera_calibration import Calibration
    from pinnray.vision.rig.exposure import Exposure
    from pinnray.vision.rig.motion import Motion


def calibrate(
    images: str | Path | Iterable[str | Path],
    board: str,
    *,
    square: float,
    marker: float | None = None,
    dictionary: str = "5X5_100",
    k3: bool = False,
    out: str | Path | None = None,
) -> "Calibration":
    """Calibrate a camera from photographs of a chessboard or a ChArUco board.

    Args:
        images: Photographs of the board, all of one size: pictures, folders, patterns, or a video.
        board: Inner corners of a chessboard, such as "9x6", or squares of a ChArUco board, "charuco:8x6".
        square: Side of a square, mm.
        marker: Side of a marker of a ChArUco board, mm.
        dictionary: ArUco dictionary of a ChArUco board.
        k3: Whether to fit the third radial coefficient too.
        out: Camera file, .json, that `track` takes; nothing is written if None.

    Raises:
        UserError: If the photographs do not determine the camera.
    """
    from pinnray.vision.calibration.camera_calibration import calibrate_camera
    from pinnray.vision.calibration.camera_file import check_format, save_calibration
    from pinnray.vision.calibration.charuco import parse_board
    from pinnray.vision.frames.sources import photographs

    given = [images] if isinstance(images, str | Path) or not isinstance(images, Iterable) else images
    sources = [as_path(each, "a photograph") for each in given]
    file = None if out is None else as_path(out, "out")
    if file is not None:
        check_format(file)
    chosen = parse_board(str(board), square, marker=marker, dictionary=dictionary)
    found = calibrate_camera(photographs(sources), chosen, k3=k3)
    if file is not None:
        save_calibration(file, found)
    return found


def track(
    source: str | Path,
    design: str | Path | Finger = "default",
    *,
    out: str | Path | None = None,
    progress: bool | None = None,
    **film: Any,
) -> Observations:
    """Measure the markers of a finger in a film that shows it at rest, pressed, and held.

    Args:
        source: Video, folder or glob of pictures, or number of a camera.
        design: The finger, in one of the ways of `mesh`.
        out: Folder for observations, tracks and pictures; nothing is kept if None.
        progress: Whether to show the stages; if None in a notebook only.
        film: How it is read, by the words of `pinnray.film.film.FilmSettings`: `camera`, `workspace`,
            `colour`, `method`, `fps`.

    Raises:
        UserError: If the film does not show the finger.
    """
    from pinnray.film.track_film import track_film
    from pinnray.runtime.stages import shown_stages

    opened, finger = FilmSettings(**film).of(str(source)), read_finger(design)
    with output_folder(out) as folder, shown_stages(progress) as stages, stages.stage("track") as report:
        Path(folder).mkdir(parents=True, exist_ok=True)
        _, found, _ = track_film(opened, finger, Path(folder), report, video=out is not None)
    return found


def film_forces(
    source: str | Path,
    design: str | Path | Finger = "default",
    *,
    material: Material | str | None = None,
    progress: bool | None = None,
    **given: Any,
) -> "pd.DataFrame":
    """Estimate the indenter's force and its place in every frame of a film, from the markers.

    Args:
        source: The film, as for `track`.
        design: The finger.
        material: The elastic constants, or the name of a material; unless a law of finite strain
            is given, the neo-Hookean one is taken. The force is in proportion to Young's modulus. On the
            way back, and after a hold, its interval is wider by the material's `loss`.
        progress: Whether to show the stages; if None in a notebook only.
        given: How the film is read, as for `track`, and parameters of the finger and the material, as for
            `solve`.

    Returns:
        A row for every frame, by the columns of `force.csv`: time, force in N and contact's place in mm with
        95 % intervals, the markers' travel in mm and the branch, such as "loading" or "unloading".

    Raises:
        UserError: If the film does not show the finger, or DOLFINx is missing.
    """
    import numpy as np
    import pandas as pd

    from pinnray.film.force_estimate import MESH, force_row, force_tracker, forces_of, loss_remark
    from pinnray.film.track_film import track_film
    from pinnray.geometry.cache import finger_mesh, mesh_sizes
    from pinnray.runtime.stages import shown_stages

    film = FilmSettings(**taken(given, FilmSettings)).of(str(source))
    words = ("material", *FilmSettings.model_fields)
    finger, elastic, _ = read_job(design, material, None, given, besides=words, allowed=MATERIAL)
    with shown_stages(progress) as stages:
        with TemporaryDirectory() as folder, stages.stage("track") as report:
            tracking, seen, _ = track_film(film, finger, Path(folder), report, video=False)
        with stages.stage("mesh"):
            mesh = finger_mesh(finger, settings=mesh_sizes(finger, usual=MESH))
        with stages.stage("force") as report:
            known = learned_of(design)
            tracker = force_tracker(mesh, finger, elastic, seen.points, plane=seen.plane, learned=known)
            forces = forces_of(tracking, tracker, elastic.loss, report)
    if not elastic.loss and (remark := loss_remark(forces, 0.0)):
        warnings.warn(remark, stacklevel=2)
    return pd.DataFrame([force_row(force, finger.depth) for force in forces]).fillna(np.nan)


def rig(
    design: str | Path | Finger = "default",
    solver: str | Solver | None = None,
    *,
    out: str | Path,
    exposure: "Exposure | None" = None,
    motion: "Motion | None" = None,
    codec: str = "ffv1",
    seed: int = 0,
    size: float | MeshSettings | None = None,
    material: Material | str | None = None,
    load: Load | LoadKind | None = None,
    progress: bool | None = None,
    options: Mapping[str, object] = MappingProxyType({}),
    **given: Any,
) -> Path:
    """Film a pressed finger with a virtual camera, and write the true markers and forces beside the film.

    Args:
        design: The finger, in one of the ways of `mesh`.
        solver: Of the filmed displacements; the finite-strain simulation of `compare` if None.
        out: Folder for the film and its files, which is replaced.
        exposure: Light, lens and sensor, as `pinnray.vision.rig.exposure.Exposure`.
        motion: Numbers of frames at rest, moving and held, as `pinnray.vision.rig.motion.Motion`.
        codec: `ffv1` or `png` (lossless), `mjpg` or `mp4v`.
        seed: Of the noise.
        size: Largest element in walls and ribs, mm.
        material: The elastic constants, or the name of a material.
        load: Motion of the indenter, or its kind alone.
        progress: Whether to show the stages; if None in a notebook only.
        options: Of the command line, for `run.json`.
        given: Camera, markers and calibration boards by the words of
            `pinnray.film.rig_settings.RigSettings`, such as `frame`, `tilt`, `paint`, `boards`; parameters of
            finger, material and load, as for `solve`.

    Returns:
        The video; `camera.json` and `observations_true.csv` are beside it.

    Raises:
        UserError: If the finger cannot be filmed so.
    """
    from pinnray.film.virtual_film import film_finger
    from pinnray.geometry.cache import finger_mesh
    from pinnray.runtime.output_folder import check_output
    from pinnray.runtime.stages import shown_stages
    from pinnray.solvers.problem import Problem
    from pinnray.vision.rig.exposure import Exposure
    from pinnray.vision.rig.motion import Motion
    from pinnray.vision.rig.recording_files import FILES, check_codec

    folder = as_path(out, "out")
    check_output(folder)
    check_codec(codec)
    settings = RigSettings(**taken(given, RigSettings))
    words = ("size", "material", "load", *RigSettings.model_fields)
    finger, elastic, moved = read_job(design, material, load, given, besides=words)
    settings.view(finger), settings.sheet()  # or says what is wrong, before the mesh is made
    chosen = None if solver is None else read_solver(solver)
    with shown_stages(progress) as stages:
        with stages.stage("mesh"):
            mesh = finger_mesh(finger, settings=mesh_settings(size))
        film_finger(
            Problem(mesh, elastic, moved, finger=finger),
            chosen,
            folder,
            stages,
            rig=settings,
            exposure=exposure or Exposure(),
            motion=motion or Motion(),
            codec=codec,
            seed=seed,
            options=options,
        )
    return folder / FILES[codec]


def read_observations(
    given: "str | Path | Observations | pd.DataFrame | None", design: Finger
) -> Observations | None:
    """Observations of a finger, from a data frame, a CSV file, or a film."""
    if given is None or isinstance(given, Observations):
        return given
    if isinstance(given, str | Path) and Path(given).suffix.lower() != ".csv":
        return track(given, design)
    return load_measurements(given, marker_radius=design.marker_radius)
