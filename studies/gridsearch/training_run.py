"""One run of a grid search: trains the paper's network and measures its distance from `fem`."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter

from compare.evaluation.differences import field_difference
from geometry.arrays import FloatArray
from geometry.atomic import write_json
from geometry.errors import UserError
from geometry.mesh.quadrature import body_quadrature, edge_quadrature
from geometry.mesh.triangle_mesh import TriangleMesh
from solvers.problem import Load, Material, Problem, contact_functional
from solvers.registry import make_solver
from solvers.solution import Solution
from solvers.solver import Progress, TrainedSolver, TrainingContext, TrainingDiverged

RESULT_FILE = "result.json"
TRAINED, DIVERGED, FAILED = "trained", "diverged", "failed"


@dataclass(frozen=True)
class GridPoint:
    """A point of the grid.

    Attributes:
        learning_rate: Learning rate of the optimiser.
        bc_weight: Weight of the boundary conditions in the loss, MPa/mm².
    """

    learning_rate: float
    bc_weight: float

    @property
    def name(self) -> str:
        """Its name in messages, and its folder."""
        return f"lr-{self.learning_rate}_bc-{self.bc_weight}"


@dataclass(frozen=True, eq=False)
class ReferenceSolution:
    """The solution on the shared mesh that runs are compared with.

    Attributes:
        energy: Elastic energy per depth, N mm/mm.
        displacement: Displacement at the points of `body_quadrature`, shape (q, 2), mm.
    """

    energy: float
    displacement: FloatArray

    @classmethod
    def of(cls, solution: Solution) -> "ReferenceSolution":
        """Sample a solution on its own mesh."""
        inside = body_quadrature(solution.problem.mesh).location
        return cls(float(solution.energy), solution.displacement(inside))


@dataclass(frozen=True, eq=False)
class TrainingTask:
    """All that a process needs to train one run.

    Attributes:
        point: The point of the grid.
        settings: The other settings of the solver.
        mesh: File of the shared mesh.
        material: The elastic law.
        load: The prescribed displacement of the contact.
        reference: The solution to compare with.
        folder: Folder of checkpoints and result.
        threads: Threads of torch.
    """

    point: GridPoint
    settings: Mapping[str, object]
    mesh: Path
    material: Material
    load: Load
    reference: ReferenceSolution
    folder: Path
    threads: int


@dataclass(frozen=True)
class TrainingMetrics:
    """Errors and costs of a finished training.

    Attributes:
        rel_l2_displacement: Relative L2 difference of the displacement from the reference.
        rel_energy: Signed relative difference of the energy.
        boundary_violation: The larger of the next two over the stroke.
        base_violation: Root mean square of the displacement along the base, mm.
        load_violation: Distance of the load's functional from its prescribed value, mm.
        energy: Elastic energy per depth, N mm/mm.
        loss: Last value of the total loss, MPa.
        epochs: Epochs trained.
        seconds: Time of the training, s.
    """

    rel_l2_displacement: float
    rel_energy: float
    boundary_violation: float
    base_violation: float
    load_violation: float
    energy: float
    loss: float
    epochs: int
    seconds: float


@dataclass(frozen=True)
class TrainingRun:
    """The end of the training at a point of the grid.

    Attributes:
        point: The point.
        status: `TRAINED`, `DIVERGED` or `FAILED`.
        message: A sentence.
        measured: Its errors and costs; None unless trained.
    """

    point: GridPoint
    status: str
    message: str
    measured: TrainingMetrics | None = None

    @classmethod
    def load(cls, path: Path) -> "TrainingRun":
        """Read the result that `train` wrote."""
        return TypeAdapter(cls).validate_json(path.read_bytes())


def train(task: TrainingTask, progress: Progress) -> TrainingRun:
    """Train at one point of the grid, from the last checkpoint if there is one, and write the result.

    A run that fails for another reason than divergence writes no result, so that it is tried again.
    """
    import torch

    torch.set_num_threads(task.threads)
    problem = Problem(TriangleMesh.load(task.mesh), task.material, task.load)
    solver = make_solver("pinn-std", **task.settings, **asdict(task.point))
    if not isinstance(solver, TrainedSolver):
        raise TypeError(f"{solver.name} cannot be resumed")
    context = TrainingContext(folder=task.folder, resume=True, reference_energy=task.reference.energy)
    try:
        solution = solver.in_context(context).solve(problem, progress)
        run = TrainingRun(task.point, TRAINED, solution.status.message, measure(solution, task.reference))
    except TrainingDiverged as error:
        run = TrainingRun(task.point, DIVERGED, str(error))
    except UserError as error:
        return TrainingRun(task.point, FAILED, str(error))
    write_json(task.folder / RESULT_FILE, asdict(run))
    return run


def measure(solution: Solution, reference: ReferenceSolution) -> TrainingMetrics:
    """Errors of a solution against the reference and its own boundary conditions."""
    rule = body_quadrature(solution.problem.mesh)
    displacement = solution.displacement(rule.location)
    base, load = boundary_violations(solution)
    stroke = float(np.linalg.norm(solution.problem.load.values))
    return TrainingMetrics(
        rel_l2_displacement=field_difference(displacement, reference.displacement, rule.weights).rel_l2,
        rel_energy=float(solution.energy) / reference.energy - 1,
        boundary_violation=max(base, load) / stroke,
        base_violation=base,
        load_violation=load,
        energy=float(solution.energy),
        loss=float(solution.history["total"][-1]),
        epochs=int(solution.stats["epochs"]),
        seconds=float(solution.stats["seconds"]),
    )


def boundary_violations(solution: Solution) -> tuple[float, float]:
    """Root mean square of the displacement along the base, and the error of the load's functional, mm."""
    problem = solution.problem
    points, lengths = edge_quadrature(problem.mesh, "base")
    squares = (solution.displacement(points) ** 2).sum(axis=1)
    contact, weights = contact_functional(problem)
    mean = (weights @ solution.displacement(contact))[problem.load.prescribed]
    return (
        float(np.sqrt(lengths @ squares / lengths.sum())),
        float(np.linalg.norm(mean - problem.load.values)),
    )
