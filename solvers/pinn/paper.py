"""`pinn-std --preset paper`: the paper's two networks, its loss, its optimiser, its 60,000 epochs."""

import time
from dataclasses import dataclass, field, fields, replace
from typing import ClassVar, Literal

import numpy as np
import torch

from geometry.arrays import FloatArray
from geometry.errors import UserError
from geometry.quadrature import body_quadrature
from solvers.elasticity import linear_energy_density
from solvers.pinn.collocation import Collocation, base_points, body_sample
from solvers.pinn.loss_gradient import Evaluation, Loss
from solvers.pinn.losses import DisplacementTerm, EnergyTerm, LossTerm, stiffness_matrix
from solvers.pinn.mlp_field import MlpField
from solvers.pinn.modified_mlp import ModifiedMlp
from solvers.pinn.training import OPTIMISERS, train
from solvers.problem import Problem, contact_functional
from solvers.solution import Solution, Status
from solvers.solver import Progress, check_problem, silent
from solvers.training import TrainingContext

PRECISIONS = {"single": torch.float32, "double": torch.float64}


@dataclass(frozen=True)
class PaperPinnSolver:
    """Two modified MLPs, one for u and one for v, trained by gradients on energy plus soft conditions.

    Attributes:
        epochs: Steps of the optimiser, each over all points.
        learning_rate: Of the optimiser.
        bc_weight: Factor of L_BC in the loss, MPa/mm².
        width: Neurons in a layer.
        layers: Gated layers of each network.
        base_points: Evenly spaced points of the base where the displacement should vanish.
        collocation: Where the energy is evaluated: "nodes" of the shared mesh with equal weights, as in the
            paper, "elements", by quadrature in its triangles, or "random", uniformly in the body.
        optimiser: "adam".
        device: "cpu" or "cuda".
        precision: "single" or "double".
        literal_gate: Whether the first gate has a hidden layer of its own, as printed in the paper.
        patience: The training ends early when the mean loss of so many epochs is no better than that of
            as many before; 0 never ends it, as in the paper.
        min_change: Relative decrease of that mean which counts as better.
        checkpoint_every: Epochs between checkpoints.
        threads: Threads of the processor; 0 takes as many as torch is set to.
        seed: Of the random numbers.
    """

    epochs: int = 60_000
    learning_rate: float = 1e-3
    bc_weight: float = 1000.0
    width: int = 64
    layers: int = 4
    base_points: int = 1000
    collocation: Collocation = "nodes"
    optimiser: str = "adam"
    device: Literal["cpu", "cuda"] = "cpu"
    precision: Literal["single", "double"] = "single"
    literal_gate: bool = False
    patience: int = 0
    min_change: float = 1e-4
    checkpoint_every: int = 1000
    threads: int = 0
    seed: int = 0
    _context: TrainingContext = field(default=TrainingContext(), init=False, repr=False, compare=False)
    name: ClassVar[str] = "pinn-std"
    laws: ClassVar[tuple[str, ...]] = ("linear",)
    loads: ClassVar[tuple[str, ...]] = ("mean", "point")

    def __post_init__(self) -> None:
        for setting in ("epochs", "learning_rate", "bc_weight", "width", "layers"):
            if not getattr(self, setting) > 0:
                raise UserError(f"pinn-std: {setting} must be positive, got {getattr(self, setting)}")
        if self.base_points < 2:
            raise UserError(f"pinn-std: base_points must be at least 2, got {self.base_points}")
        for setting in ("patience", "checkpoint_every", "threads", "seed"):
            if getattr(self, setting) < 0:
                raise UserError(f"pinn-std: {setting} must be zero or more, got {getattr(self, setting)}")
        if self.optimiser not in OPTIMISERS:
            raise UserError(f"pinn-std: optimiser must be {' or '.join(OPTIMISERS)}, got {self.optimiser!r}")
        if self.device == "cuda" and not torch.cuda.is_available():
            raise UserError("pinn-std: device cuda needs a GPU and torch's CUDA build; take device=cpu")

    def settings(self) -> dict[str, object]:
        """Network, loss, optimiser and seed."""
        return {"preset": "paper"} | {
            entry.name: getattr(self, entry.name) for entry in fields(self) if entry.init
        }

    def in_context(self, context: TrainingContext) -> "PaperPinnSolver":
        """The same solver that saves and resumes in `context`; see `TrainedSolver`."""
        solver = replace(self)
        object.__setattr__(solver, "_context", context)
        return solver

    @property
    def network(self) -> ModifiedMlp:
        """The two networks' shape."""
        return ModifiedMlp(width=self.width, layers=self.layers, literal_gate=self.literal_gate)

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Train on the problem; see `Solver`."""
        check_problem(self, problem)
        started = time.perf_counter()
        loss = self.loss(problem)
        area = float(problem.mesh.areas.sum())

        def report(epoch: int, evaluation: Evaluation) -> None:
            terms = ", ".join(f"{name} {value:.3g}" for name, value in evaluation.terms.items())
            progress(
                epoch / self.epochs, f"epoch {epoch}: {terms}, energy {area * evaluation.terms['PDE']:.4g}"
            )

        initial = self.network.initial(self.seed, PRECISIONS[self.precision]).to(self.device)
        trained = train(
            loss,
            initial,
            optimiser=self.optimiser,
            learning_rate=self.learning_rate,
            epochs=self.epochs,
            report=report,
        )
        mlp_field = MlpField(self.network, trained.parameters.double().cpu())
        rule = body_quadrature(problem.mesh)
        density = linear_energy_density(mlp_field.gradient(rule.location), problem.material.lame)
        seconds = time.perf_counter() - started
        columns = ("epoch", *loss.factors, "total", "seconds")
        return Solution(
            solver=self.name,
            problem=problem,
            field=mlp_field,
            energy=float((rule.weights * density).sum()),
            reaction=np.zeros(2),
            status=Status(False, f"{self.epochs} epochs; the paper's recipe has no criterion"),
            stats={
                "seconds": seconds,
                "epochs": len(trained.history),
                "parameters": trained.parameters.numel(),
                "seed": self.seed,
                "device": self.device,
                "seconds_per_epoch": seconds / len(trained.history),
                "collocation_points": len(loss.terms[0].points),
                "threads": torch.get_num_threads(),
            },
            history=dict(zip(columns, trained.history.T, strict=True)),
        )

    def loss(self, problem: Problem) -> Loss:
        """The paper's loss: L_PDE + bc_weight L_BC."""

        def tensor(array: FloatArray) -> torch.Tensor:
            return torch.tensor(np.asarray(array), dtype=PRECISIONS[self.precision], device=self.device)

        body = body_sample(problem.mesh, self.collocation, self.seed)
        base = base_points(problem.mesh, self.base_points)
        contact, functional = contact_functional(problem)
        targets = np.array([[value or 0.0] for value in problem.load.displacement])
        wanted = np.array([[float(value is not None)] for value in problem.load.displacement])
        terms: list[LossTerm] = [
            EnergyTerm(
                tensor(body.points), tensor(body.shares), tensor(stiffness_matrix(problem.material.lame))
            ),
            DisplacementTerm(
                "BC",
                tensor(base),
                targets=tensor(np.zeros((2, len(base)))),
                weights=tensor(np.full((2, len(base)), 1 / len(base))),
            ),
            DisplacementTerm(
                "BC", tensor(contact), tensor(targets), tensor(wanted), functional=tensor(functional[None])
            ),
        ]
        return Loss(self.network, terms, {"PDE": 1.0, "BC": self.bc_weight})
