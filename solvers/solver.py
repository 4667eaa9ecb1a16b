"""The interface of a solver: settings live in the solver, the problem is the argument."""

import re
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from math import inf, pow
from pathlib import Path
from typing import Any, ClassVar, Literal, Protocol, cast, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from pinnray.geometry.observations import Observations
from pinnray.runtime.errors import InapplicableError, UserError
from pinnray.runtime.progress import Progress as Progress
from pinnray.runtime.progress import silent as silent
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.solution import Solution, Status

RESERVED = "truth"
"""Name of the field of a simulated finger, which no solver can have."""

NONE_SEEN = "none of the markers is visible; at least one is needed, or leave the measurements out"

Family = Literal["finite elements", "neural network", "statistics"]


class UnsupportedProblemError(InapplicableError):
    """The solver does not support the problem."""


class NoSolutionError(UserError):
    """A solver looked for a solution of a sound problem and found none; says what was tried."""


class UnsoundSolutionError(UserError):
    """A solver returned something that is no solution, such as numbers that are not finite."""


class SolverFailedError(UserError):
    """A solver raised an exception or called `sys.exit`, the cause of this one."""

    def __init__(self, solver: "Solver", cause: BaseException) -> None:
        call, *frames = traceback.extract_tb(cause.__traceback__)
        home = getattr(sys.modules.get(type(solver).__module__), "__file__", None)
        own = [each for each in frames if home and Path(each.filename).is_relative_to(Path(home).parent)]
        last = [call, *frames, *own][-1]  # the innermost line of the solver's folder, if one is there
        place = f"{last.filename}:{last.lineno}"
        message = f"solver {solver.name} raised {type(cause).__name__}: {cause} ({place})"
        super().__init__(" ".join(message.split()))


@runtime_checkable
class Solver(Protocol):
    """A method that solves a `Problem`.

    It can be made without arguments; its properties may be plain class attributes. It may also have the
    attributes of `Traits`.
    """

    @property
    def name(self) -> str:
        """Its name on the command line."""

    @property
    def laws(self) -> tuple[str, ...]:
        """Supported material laws (`Material.law`), the default first."""

    @property
    def loads(self) -> tuple[str, ...]:
        """Supported kinds of load (`Load.kind`)."""

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Solve `problem`; an `UnsupportedProblemError` says that the solver does not support it."""

    def settings(self) -> dict[str, object]:
        """Every setting that changes the result, as JSON-ready values; recorded with the result."""


class FieldSettings:
    """Base of our solvers: frozen dataclasses whose fields are their settings."""

    name: ClassVar[str]
    family: ClassVar[Family]
    laws: ClassVar[tuple[str, ...]]
    loads: ClassVar[tuple[str, ...]]
    assimilates: ClassVar[bool] = False
    preset: ClassVar[str | None] = None  # Of a solver that is one preset of several

    def settings(self) -> dict[str, object]:
        """The preset and the fields; see `Solver`."""
        names = [entry.name for entry in fields(cast(Any, self)) if entry.init]
        preset = {} if self.preset is None else {"preset": self.preset}
        return preset | {name: getattr(self, name) for name in names}

    def check_positive(self, *names: str) -> None:
        """Raise a `UserError` unless settings are above zero and finite."""
        for name in names:
            if not 0 < (value := getattr(self, name)) < inf:
                raise UserError(f"{self.name}: {name} must be positive, got {value}")

    def check_not_negative(self, *names: str) -> None:
        """Raise a `UserError` unless settings are zero or more, or None."""
        for name in names:
            if (value := getattr(self, name)) is not None and not 0 <= value < inf:
                raise UserError(f"{self.name}: {name} must be zero or more, got {value}")


@dataclass(frozen=True)
class ElementSettings(FieldSettings):
    """Settings of a solver by Lagrange elements."""

    degree: int = 2  # Of the elements, 1 or 2

    def __post_init__(self) -> None:
        if self.degree not in (1, 2):
            raise UserError(f"{self.name} has elements of degree 1 and 2, not {self.degree}")


@dataclass(frozen=True)
class Cost:
    """Time and memory of a solver on one core for the default finger and load, by default those of `fem`.

    It need not be exact: by it solvers are shared out between two processes and fine meshes ask for consent.
    """

    per_triangle: float = 55.0  #: Time for each of the default mesh's triangles, µs
    fixed: float = 0.0  #: Time that does not depend on the mesh, s
    kilobytes: float = 30.0  #: Memory for each triangle: factors and error estimates take most of it

    def of_mesh(self, triangles: int) -> float:
        """The part of the time that depends on the mesh, s; factors take more of a fine mesh's triangles."""
        return 1e-6 * self.per_triangle * triangles * pow(triangles / 18_000, 0.25)

    def seconds(self, triangles: int) -> float:
        """Time on a mesh, s."""
        return self.fixed + self.of_mesh(triangles)


@dataclass(frozen=True)
class Traits:
    """Optional attributes of a solver, with their values for a solver that lacks them."""

    assimilates: bool = False  #: Whether it uses the observations of a problem
    family: Family | None = None  #: Kind of method; None if unknown
    twin: str | None = None  #: Solver by finite elements that fits the markers in the same way, if any
    friction: bool = False  #: Whether its load `cylinder` may have friction
    cost: Cost = Cost()  #: Time that it takes

    @classmethod
    def of(cls, solver: Solver) -> "Traits":
        """The traits of a solver."""
        given: dict[str, Any] = {each.name: getattr(solver, each.name, each.default) for each in fields(cls)}
        return cls(**given)


def check_name(name: str) -> None:
    """Raise a `UserError` unless a name can name a file and is not reserved for the truth."""
    fits = isinstance(name, str) and re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}", name)
    if not fits or name == RESERVED:
        taken = f"{RESERVED} is the simulated finger's" if name == RESERVED else "files are called so"
        raise UserError(
            f"a solver is called {name!r}: {taken}; take up to 64 letters, digits, '.', '_', '-', and begin "
            "with a letter or a digit"
        )


def check_problem(solver: Solver, problem: Problem) -> None:
    """Raise an error if the solver lacks the law or the kind of load, or if no marker was seen."""
    if problem.observations is not None and not problem.observations.known:
        raise UserError(f"{solver.name}: {NONE_SEEN}")
    if problem.material.law not in solver.laws:
        raise UnsupportedProblemError(
            f"{solver.name} has the law {' or '.join(solver.laws)}, not {problem.material.law}"
        )
    check_load(solver, problem.load)


def check_load(solver: Solver, load: Load) -> None:
    """Raise an `UnsupportedProblemError` if the solver does not support the kind of load."""
    if load.kind not in solver.loads:
        raise UnsupportedProblemError(
            f"{solver.name} takes the loads {', '.join(solver.loads)}, not {load.kind!r}; "
            "`pinnray solvers` lists the loads of each"
        )
    if load.friction and not Traits.of(solver).friction:
        raise UnsupportedProblemError(
            f"{solver.name} takes a cylinder without friction; leave friction out, or take "
            "fem-nonlinear or fem-3d"
        )


def check_law(solvers: Sequence[Solver], material: Material) -> None:
    """Raise a `UserError` if the law of a material was given, and none of the solvers has it."""
    if "law" in material.model_fields_set and not any(material.law in solver.laws for solver in solvers):
        known = "; ".join(f"{solver.name} has {', '.join(solver.laws)}" for solver in solvers)
        raise UserError(f"law {material.law}: none of the solvers has it ({known})")


def check_asked(solver: Solver, material: Material, observations: Observations | None) -> None:
    """Raise a `UserError` if the only solver lacks the law that was given, or takes no measurements."""
    check_law([solver], material)
    if observations is not None and not Traits.of(solver).assimilates:
        raise UserError(f"{solver.name} does not assimilate markers; `compare` compares it with measurements")


def with_law(material: Material, solver: Solver) -> Material:
    """The material with a law that the solver supports: its own if possible, else the solver's default.

    An `UnsupportedProblemError` says that this law does not exist for the material's plane state.
    """
    law = material.law if material.law in solver.laws else solver.laws[0]
    try:
        made = Material(**{**material.model_dump(exclude_unset=True), "law": law})
    except UserError as error:
        raise UnsupportedProblemError(f"{solver.name}: {error}") from None
    if "law" not in material.model_fields_set:
        made.model_fields_set.remove("law")  # nobody asked for it
    return made.made_of(material.substance)


def solved(solver: Solver, problem: Problem, progress: Progress = silent) -> Solution:
    """The solution of a solver, checked, so that a fault of a plug-in is not found far from it.

    Raises:
        UnsoundSolutionError: If it is no `Solution`, or an array in it has a wrong shape or is not finite.
        SolverFailedError: If it raises anything but an error of the input or system, or calls `sys.exit`.
    """
    return _checked(solver, lambda: solver.solve(problem, progress), problem)


def _checked(solver: Solver, solve: Callable[[], Solution], problem: Problem) -> Solution:
    """The solution under its solver's name, or the errors of `solved`."""
    try:
        solution = solve()
    except (SystemExit, FileNotFoundError) as error:  # such as of a file with its weights
        raise SolverFailedError(solver, error) from error
    except (UserError, OSError):
        raise
    except Exception as error:
        raise SolverFailedError(solver, error) from error
    for value, kind in ((solution, Solution), (getattr(solution, "status", None), Status)):
        if not isinstance(value, kind):
            said = f"{kind.__name__.lower()} is {type(value).__name__}, not a {kind.__name__}"
            raise UnsoundSolutionError(f"solver {solver.name}: its {said}; see docs/own-solver.md")
    try:
        fault = _fault(solution, problem)
    except Exception as error:  # of the field's own methods
        raise SolverFailedError(solver, error) from error
    if fault:
        raise UnsoundSolutionError(f"solver {solver.name}: its {fault}; see docs/own-solver.md")
    # A solver that passes on another one's solution would be a second row of that name.
    return solution if solution.solver == solver.name else replace(solution, solver=solver.name)


def _fault(solution: Solution, problem: Problem) -> str | None:
    """A clause on a number or array of a solution that cannot be right; None if all can."""
    if solution.problem.mesh.digest != problem.mesh.digest:
        return "solution is on another mesh than the problem that it was given"
    for part, columns in (("stats", solution.stats), ("history", solution.history)):
        if not isinstance(columns, Mapping):
            return f"{part} is {type(columns).__name__}, not a dictionary"
    lengths = {name: len(column) for name, column in solution.history.items()}
    if len(set(lengths.values())) > 1:
        return f"history has columns of different lengths: {lengths}"
    mesh, seen = problem.mesh, problem.observations
    checks: list[tuple[str, ArrayLike | None, tuple[int, ...]]] = [
        ("energy", solution.energy, ()),
        ("reaction", solution.reaction, (2,)),
        ("displacement", solution.field.displacement(mesh.at_nodes()), (len(mesh.points), 2)),
        ("gradient", solution.field.gradient(mesh.at_centroids()), (len(mesh.triangles), 2, 2)),
    ]
    if solution.left_out is not None:
        checks.append(("left_out", solution.left_out, (len(seen.points) if seen else 0, 2)))
    for what, given, shape in checks:
        values = np.asarray(given)
        other = what in ("displacement", "gradient") and type(given) is not np.ndarray
        if other or values.dtype.kind not in "fiu" or values.shape != shape:
            found = type(given).__name__ if other else f"{values.dtype} of shape {values.shape}"
            return f"{what} is {found}, not floats of shape {shape}"
        if what == "left_out" and seen is not None:
            values = values[seen.visible]
        if not np.isfinite(values).all():
            return f"{what} is not finite everywhere"
    return None


class TrainingDiverged(UserError):
    """The training diverged; the message says when, by which quantity, and what to try."""


@dataclass(frozen=True)
class TrainingContext:
    """Runtime context of a training, which does not change its result."""

    folder: Path | None = None  #: Folder for checkpoints and the history; None to write nothing
    resume: bool = False  #: Whether to continue from the checkpoint in `folder` if there is one


@runtime_checkable
class TrainedSolver(Solver, Protocol):
    """A solver whose training can be saved and resumed."""

    def in_context(self, context: TrainingContext) -> Solver:
        """The same solver with this context, which is no setting."""


@runtime_checkable
class Refittable(Protocol):
    """A solver that shares work between fits to different observations of the same markers."""

    def refitter(self, problem: Problem) -> Callable[[Observations], Solution]:
        """A function that solves the problem with other observations, like `solve` but without `left_out`."""


@runtime_checkable
class Transferable(Protocol):
    """A solver whose estimates at one load hold at another."""

    def transferred(self, solution: Solution, problem: Problem, other: Problem) -> Solution:
        """The solution of another problem with the parameters estimated in a solution of the first."""


def refitter(solver: Solver, problem: Problem) -> Callable[[Observations], Solution]:
    """A function that solves a problem for any observations, sharing work where the solver can."""
    if isinstance(solver, Refittable):
        refit = solver.refitter(problem)
        return lambda seen: _checked(solver, lambda: refit(seen), replace(problem, observations=seen))
    return lambda observations: solved(solver, replace(problem, observations=observations))
