"""A cross-validation to run: finger, solvers, held-out markers and loads, and the output folder."""

from collections.abc import Sequence
from dataclasses import dataclass, field, is_dataclass, replace
from pathlib import Path
from typing import Any, cast

import numpy as np

from pinnray.comparison.evaluation.truths import EVERY_TRUTH, SLIDING, TRUTHS, Truth, check_truths
from pinnray.geometry.cache import mesh_sizes
from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.observations import Observations
from pinnray.geometry.picture_frame import FIXED, PARTS, Homography, Registration
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.content_hash import sources_digest
from pinnray.runtime.errors import UserError
from pinnray.runtime.machine import cores, package_versions
from pinnray.solvers.problem import Load, Material
from pinnray.solvers.solver import Solver, check_law, check_load, check_name, with_law
from pinnray.studies.crossval.folds import ALL, SCHEMES

SIZES = MeshSettings(size=0.5)
"""Usual element sizes: `fem` is off by 0.01 mm at the markers, a hundredth of its model error."""
FEWEST_MARKERS = 3
"""Some to hold out and some to give."""


def of_draw(solver: Solver, seed: int) -> Solver:
    """A solver, of any class, for a draw, whose `seed` is added to its own if it draws random numbers.

    Raises:
        UserError: If its class cannot be made with another seed.
    """
    settings = solver.settings()
    first = settings.get("seed")
    if not seed or not isinstance(first, int):
        return solver
    try:
        if is_dataclass(solver):
            return cast(Solver, replace(cast(Any, solver), seed=first + seed))
        return type(solver)(**{**settings, "seed": first + seed})
    except UserError:
        raise
    except Exception as error:  # the constructor of another package may raise anything
        raise UserError(f"solver {solver.name} cannot be made with seed {first + seed}: {error}") from error


@dataclass(frozen=True, eq=False, kw_only=True)
class CrossvalStudy:
    """A cross-validation to run, and its output folder.

    Attributes:
        design: The finger.
        solvers: The solvers.
        out: Output folder; folds that an earlier study with equal settings finished there are reused.
        mesh: Element sizes of the mesh that solvers share; None means the mesh of the finger's file if it
            has one, else `SIZES`.
        material: The elastic constants; each solver takes its own law.
        load: The prescribed displacement of the contact.
        truths: Keys of `TRUTHS`, or `EVERY_TRUTH` alone.
        layouts: Marker layouts at which every truth is sampled; empty for the design's own.
        schemes: Keys of `SCHEMES` other than `ALL`.
        seeds: Number of draws of the noise, and of the solvers' random numbers.
        noise: Standard deviation of a simulated marker's displacement, mm.
        frame: By how much the simulated pressed pictures are turned, shifted and scaled, in directions that
            each draw chooses; the observations say so.
        measurements: Marker displacements from elsewhere; None for the virtual experiment.
        processes: Solvers run at a time.
    """

    design: Finger
    solvers: Sequence[Solver]
    out: Path
    mesh: MeshSettings | None = None
    material: Material = field(default_factory=Material)
    load: Load = field(default_factory=Load)
    truths: Sequence[str] = (SLIDING.name,)
    layouts: Sequence[str] = ()
    schemes: Sequence[str] = tuple(scheme for scheme in SCHEMES if scheme != ALL)
    seeds: int = 5
    noise: float = 0.005
    frame: Registration = FIXED
    measurements: Observations | None = None
    processes: int = field(default_factory=cores)

    def __post_init__(self) -> None:
        object.__setattr__(self, "mesh", mesh_sizes(self.design, self.mesh, SIZES))

    @property
    def truth_names(self) -> tuple[str, ...]:
        """The chosen truths, whether there are measurements or not."""
        return tuple(TRUTHS) if tuple(self.truths) == (EVERY_TRUTH,) else tuple(self.truths)

    @property
    def chosen_truths(self) -> dict[str, Truth]:
        """The truths by name; none with measurements."""
        return {name: TRUTHS[name] for name in self.truth_names if self.measurements is None}

    @property
    def markers(self) -> dict[str, FloatArray]:
        """Centres of the markers by layout, each of shape (m, 2), mm.

        Raises:
            UserError: If the finger does not have such a layout.
        """
        design, found = self.design, {}
        for layout in self.layouts or (design.marker_layout,):
            if layout == design.marker_layout:
                found[layout] = design.markers
            elif isinstance(design, Design):
                found[layout] = design.replaced(marker_layout=layout).markers
            else:
                raise UserError(
                    f"layouts: {design.name} has no layout {layout!r}; its markers are those of its "
                    f"drawing, {design.marker_layout!r}"
                )
        return found

    @property
    def label(self) -> str:
        """`simulated` or `measured`, for captions."""
        return "simulated" if self.measurements is None else self.measurements.label

    def pressed_picture(self, points: FloatArray, seed: int) -> Homography:
        """The homography of a draw's pressed picture, about the middle of points, shape (m, 2), mm."""
        signs = np.random.default_rng([seed, len(points)]).choice([-1.0, 1.0], len(PARTS))
        return Homography(points.mean(axis=0), signs * self.frame.deviations)

    def check(self) -> None:
        """Raise a `UserError` for a study that cannot be done, before anything is computed."""
        simulated = self.layouts or not self.frame.fixed or tuple(self.truths) != (SLIDING.name,)
        if simulated and self.measurements:
            raise UserError(
                "truths, layouts and frame are of a simulated experiment; with measurements name none"
            )
        check_truths(self.truth_names, self.design)
        _check_distinct("layouts: a layout", self.layouts)
        for layout, points in self.markers.items():
            if len(points) < FEWEST_MARKERS:
                raise UserError(
                    f"cross-validation needs {FEWEST_MARKERS} markers, not the {len(points)} of the layout "
                    f"{layout!r}"
                )
        if not self.solvers:
            raise UserError("no solver was asked for; name at least one")
        _check_distinct("a solver", [solver.name for solver in self.solvers])
        known = [scheme for scheme in SCHEMES if scheme != ALL]
        if unknown := [scheme for scheme in self.schemes if scheme not in known]:
            raise UserError(f"schemes: there is no scheme {unknown[0]!r}; there are {', '.join(known)}")
        if not self.schemes:
            raise UserError(f"schemes: name at least one of {', '.join(known)}")
        _check_distinct("schemes: a scheme", self.schemes)
        if self.seeds < 1:
            raise UserError(f"seeds {self.seeds}: give a whole number from 1")
        if not 0 <= self.noise <= 100:  # mm, more than a finger moves
            raise UserError(
                f"noise {self.noise:g}: give a standard deviation of zero or more, at most 100 mm"
            )
        check_law(self.solvers, self.material)
        for solver in self.solvers:
            check_name(solver.name)
            check_load(solver, self.load)
            with_law(self.material, solver)
        normal = self.load.displacement[1]
        if self.measurements is None and normal is None:
            raise UserError("the virtual experiment presses on the finger: prescribe v")
        for name, truth in self.chosen_truths.items():
            if truth.radius is not None and (normal or 0.0) >= 0:
                raise UserError(f"truth {name}: a cylinder presses on the finger: prescribe a v below zero")

    def definition(self, given: Observations | None) -> dict[str, Any]:
        """Everything that finished folds depend on but the solvers' settings, which are kept with them."""
        arrays = given and (given.points, given.displacements, given.standard_deviations)
        return {
            "schema": 1,
            "design": self.design.definition(),
            "mesh": self.mesh and self.mesh.model_dump(),
            "material": self.material.model_dump(),
            "load": self.load.model_dump(mode="json"),
            "versions": package_versions(),
            "program_sha256": sources_digest(__name__),
            "noise_mm": None if given else self.noise,
            "frame": str(given.pressed if given else self.frame),
            "measurements": arrays and [values.tolist() for values in arrays],
        }


def _check_distinct(what: str, names: Sequence[str]) -> None:
    if len(set(names)) < len(names):
        raise UserError(f"{what} is named twice: {', '.join(names)}")


def visible_markers(observations: Observations) -> Observations:
    """The visible markers from base to tip.

    Raises:
        UserError: If there are fewer than `FEWEST_MARKERS`.
    """
    visible = observations.visible
    if (count := int(visible.sum())) < FEWEST_MARKERS:
        raise UserError(f"cross-validation needs {FEWEST_MARKERS} markers that were seen, not {count}")
    order = np.flatnonzero(visible)[observations.points[visible, 0].argsort(kind="stable")]
    names = ("points", "displacements", "standard_deviations", "visible")
    return replace(observations, **{name: getattr(observations, name)[order] for name in names})
