"""Preset `paper` of `pinn-std`: the paper's two networks, loss and optimiser, trained for 60,000 epochs."""

import time
from dataclasses import dataclass, field, replace
from typing import ClassVar, Literal

import numpy as np
import torch

from pinnray.geometry.mesh.boundary import evenly_spaced_points
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.content_hash import content_hash
from pinnray.runtime.errors import UserError
from pinnray.solvers.assimilation.misfit import Weighting
from pinnray.solvers.pinn.network_solver import NetworkSolver
from pinnray.solvers.pinn.paper.checkpoint import CheckpointStore
from pinnray.solvers.pinn.paper.loss import DisplacementTerm, EnergyTerm, Loss, LossTerm, stiffness_matrix
from pinnray.solvers.pinn.paper.modified_mlp import ModifiedMlp
from pinnray.solvers.pinn.paper.trained_field import MlpField, assess_training
from pinnray.solvers.pinn.paper.training import Training
from pinnray.solvers.pinn.threading import pool
from pinnray.solvers.problem import Problem, contact_functional
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import Cost, Progress, TrainingContext, check_problem, silent

PRECISIONS = {"single": torch.float32, "double": torch.float64}

FREE = ("epochs", "checkpoint_every", "device")
"""Settings that may change when a training is resumed."""


@dataclass(frozen=True)
class PaperPinnSolver(NetworkSolver):
    """Two modified MLPs, for u and v, all weights trained by Adam on energy plus penalty terms.

    Attributes:
        epochs: Steps of the optimiser, each over all points.
        learning_rate: Of the optimiser.
        bc_weight: Factor of L_BC in the loss, MPa/mm².
        width: Neurons in a layer.
        layers: Gated layers of each network.
        base_points: Evenly spaced points of the base where the displacement should vanish.
        device: "cpu" or "cuda".
        precision: "single" or "double".
        checkpoint_every: Epochs between checkpoints.
        seed: Of the random numbers.
    """

    epochs: int = 60_000
    learning_rate: float = 1e-3
    bc_weight: float = 1000.0
    width: int = 64
    layers: int = 4
    base_points: int = 1000
    device: Literal["cpu", "cuda"] = "cpu"
    precision: Literal["single", "double"] = "single"
    checkpoint_every: int = 1000
    seed: int = 0
    _context: TrainingContext = field(default=TrainingContext(), init=False, repr=False, compare=False)
    name: ClassVar[str] = "pinn-std"
    preset: ClassVar[str] = "paper"
    cost: ClassVar[Cost] = Cost(per_triangle=0, fixed=21_000)

    def __post_init__(self) -> None:
        self.check_positive("epochs", "learning_rate", "bc_weight", "width", "layers")
        if self.base_points < 2:
            raise UserError(f"{self.name}: base_points must be at least 2, got {self.base_points}")
        self.check_not_negative("checkpoint_every", "seed")
        if self.device == "cuda" and not torch.cuda.is_available():
            raise UserError(f"{self.name}: device cuda needs a GPU and torch's CUDA build; take device=cpu")
        _ = self.weighting

    def in_context(self, context: TrainingContext) -> "PaperPinnSolver":
        """The same solver that saves and resumes in `context`; see `TrainedSolver`."""
        solver = replace(self)
        object.__setattr__(solver, "_context", context)
        return solver

    @property
    def network(self) -> ModifiedMlp:
        """The two networks' shape."""
        return ModifiedMlp(width=self.width, layers=self.layers)

    def solve(self, problem: Problem, progress: Progress = silent) -> Solution:
        """Train on the problem; see `Solver`.

        Raises:
            TrainingDiverged: If the loss is not a number or has grown beyond all bounds.
        """
        check_problem(self, problem)
        started = time.perf_counter()
        threads = torch.get_num_threads()
        with pool():
            loss = self.loss(problem)
            initial = self.network.initial(self.seed, PRECISIONS[self.precision]).to(self.device)
            area = float(problem.mesh.areas.sum())
            training = Training(loss, initial, area, self._store(problem), self.learning_rate)
            training.run(self.epochs, self.checkpoint_every, progress)
            field = MlpField(self.network, training.parameters.double().cpu())
            energy, reaction, status = assess_training(problem, field, training)
        seconds = time.perf_counter() - started
        return Solution(
            solver=self.name,
            problem=problem,
            field=field,
            energy=energy,
            reaction=reaction,
            status=status,
            stats={
                "seconds": seconds,
                "epochs": training.epoch,
                "parameters": initial.numel(),
                "collocation_points": len(loss.terms[0].points),
                "seconds_per_epoch": float(training.history[-1, -1] / training.epoch),
                "seed": self.seed,
                "device": self.device,
                "threads": threads,
            },
            history=dict(zip(training.columns, training.history.T, strict=True)),
        )

    def _store(self, problem: Problem) -> CheckpointStore | None:
        """Where to save; a checkpoint belongs to the problem and to all settings but those of `FREE`."""
        if self._context.folder is None:
            return None
        binding = {name: value for name, value in self.settings().items() if name not in FREE}
        digest = content_hash([problem.digest, binding])
        return CheckpointStore(self._context.folder, digest, self._context.resume)

    def loss(self, problem: Problem) -> Loss:
        """The paper's loss: L_PDE + bc_weight L_BC and, of a solver that assimilates, its factor times L_ASM.

        L_ASM is the mean square of the misfits' lengths, mm²; with unequal weights, the weighted mean.
        """

        def tensor(array: FloatArray) -> torch.Tensor:
            return torch.tensor(np.asarray(array), dtype=PRECISIONS[self.precision], device=self.device)

        body = problem.mesh.points  # the paper's: all alike, though some parts of the mesh are denser
        shares = np.full(len(body), 1 / len(body))
        base = evenly_spaced_points(problem.mesh, "base", self.base_points)
        contact, functional = contact_functional(problem)
        targets = np.array([[value or 0.0] for value in problem.load.displacement])
        wanted = np.array([[float(value is not None)] for value in problem.load.displacement])
        terms: list[LossTerm] = [
            EnergyTerm(tensor(body), tensor(shares), tensor(stiffness_matrix(problem.material.lame))),
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
        factors = {"PDE": 1.0, "BC": self.bc_weight}
        if (misfit := self.misfit(problem)) is not None:
            points, means = misfit.sampling()
            total = float(misfit.weights.sum())
            factors["ASM"] = total / (4 * float(problem.mesh.areas.sum()))
            terms.append(
                DisplacementTerm(
                    "ASM",
                    tensor(points),
                    targets=tensor(misfit.observed.T),
                    weights=tensor(2 * misfit.weights.T / total),
                    functional=tensor(means),
                )
            )
        return Loss(self.network, terms, factors)


@dataclass(frozen=True, kw_only=True)
class PaperPinnAsmSolver(PaperPinnSolver):
    """The networks and the training of `PaperPinnSolver`, with the paper's L_ASM in the loss.

    Attributes:
        marker_radius: As in `MarkerSettings`; the paper takes the displacement of the centre.
    """

    weights: Weighting = "paper"
    asm_weight: float = 1000.0
    scale: float = 1.0
    marker_radius: float | None = 0.0
    name: ClassVar[str] = "pinn-asm"
    twin: ClassVar[str] = "fem-asm"
    assimilates: ClassVar[bool] = True
