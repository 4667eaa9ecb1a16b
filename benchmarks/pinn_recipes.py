"""Training recipes for the networks: error over wall time on the default finger; writes the page.

To add one, put a function into RECIPES: it takes the problem on the training mesh and a clock, which returns
the used share of the time, and yields its field after every step. The clock stops while errors are evaluated.
Each recipe takes `seconds`, and about ten more.
"""

import math
import platform
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

import torch
from rich.table import Table

from benchmarks.finger_network import FingerNetwork
from benchmarks.finger_residuals import everywhere, random_samples
from benchmarks.judge import Judge, Judged, Watch
from benchmarks.optimisers.levenberg_marquardt import levenberg_marquardt
from benchmarks.optimisers.self_scaled_broyden import self_scaled_broyden
from benchmarks.optimisers.soap import Soap
from benchmarks.optimisers.spring import spring
from benchmarks.random_gates import random_gates
from benchmarks.trained_neurons import trained_neurons
from geometry.cache import finger_mesh
from geometry.finger.design import Design
from geometry.mesh.settings import MeshSettings
from solvers.pinn.finite_basis.local import PinnLocalSolver
from solvers.pinn.finite_basis.standard import PinnStdSolver
from solvers.pinn.paper.modified_mlp import ModifiedMlp
from solvers.problem import Problem
from solvers.solution import DisplacementField
from solvers.solver import Solver

SECONDS = 60.0
TRAINING_SIZE = 1.0
"""Size of the elements for quadrature (of degree 2), mm."""

SEED = 0
REPORT = Path("docs/evidence/pinn_recipes.md")

Fields = Iterator[DisplacementField]
Clock = Callable[[], float]
"""Returns the used share of the time."""

Recipe = Callable[[Problem, Clock], Fields]


def _network(problem: Problem, width: int = 32, degree: int = 2) -> FingerNetwork:
    return FingerNetwork(problem, ModifiedMlp(width=width, layers=3), degree)


def by_gradients(
    optimiser: type[torch.optim.Optimizer],
    rate: float,
    *,
    slope: float | None = None,
    finish: bool = False,
) -> Recipe:
    """Full-batch training in single precision, the learning rate falling by half a cosine.

    Args:
        optimiser: Adam, SOAP, ...
        rate: Learning rate at the start.
        slope: Steepness of the first layers, 1/mm, whose neurons then go through points of the body.
        finish: Whether the output layer is solved exactly after nine tenths of the time.
    """

    def train(problem: Problem, clock: Clock) -> Fields:
        network = _network(problem)
        start = network.initial(SEED) if slope is None else through_points(network, slope)
        parameters = start.float()
        tensors = network.tensors(parameters)
        stepper = optimiser(tensors, lr=rate)
        while (spent := clock() / (0.9 if finish else 1.0)) < 1:
            stepper.param_groups[0]["lr"] = rate * 0.5 * (1 + math.cos(math.pi * spent))
            gradient = network.energy(parameters)[1]
            for tensor, of_tensor in zip(tensors, network.tensors(gradient), strict=True):
                tensor.grad = of_tensor
            stepper.step()
            yield network.field(parameters)
        if finish:
            yield network.field(with_exact_output(network, parameters.double()))

    return train


def through_points(network: FingerNetwork, slope: float) -> torch.Tensor:
    """Initial weights; first-layer neurons of a steepness, 1/mm, pass through random quadrature points."""
    generator = torch.Generator().manual_seed(SEED)
    parameters = network.initial(SEED)
    first = network.shape.weights(parameters.view(2, -1)).first
    count = first[:, :, 0].numel()
    turn = torch.rand(count, generator=generator, dtype=torch.float64) * 2 * math.pi
    low, high = network.points.min(dim=0).values, network.points.max(dim=0).values
    half = (high - low).max() / 2
    slopes = slope * half * torch.stack([turn.cos(), turn.sin()], dim=1)
    points = network.points[torch.randint(len(network.points), (count,), generator=generator)]
    biases = -(slopes * (points - (low + high) / 2) / half).sum(dim=1)
    first.copy_(torch.cat([slopes, biases[:, None]], dim=1).view(2, 3, -1, 3).transpose(2, 3))
    return parameters


def with_exact_output(network: FingerNetwork, parameters: torch.Tensor) -> torch.Tensor:
    """The parameters with output layers of least energy, in which the residuals are affine."""
    result = parameters.clone()
    output = network.output_layers(result)
    residuals = everywhere(network)
    output.zero_()
    constant = residuals.values(result)
    columns = []
    for k in range(output.numel()):
        output[divmod(k, output.shape[1])] = 1.0
        columns.append(residuals.values(result) - constant)
        output.zero_()
    best = torch.linalg.lstsq(torch.stack(columns, dim=1), -constant[:, None], driver="gelsd").solution
    output.copy_(best.view(output.shape))
    return result


def l_bfgs(problem: Problem, clock: Clock) -> Fields:
    """L-BFGS of torch with a strong Wolfe line search, double precision."""
    network = _network(problem)
    parameters = network.initial(SEED)
    stepper = torch.optim.LBFGS([parameters], max_iter=5, history_size=100, line_search_fn="strong_wolfe")

    def closure() -> float:
        value, parameters.grad = network.energy(parameters)
        return value

    while True:
        stepper.step(closure)
        yield network.field(parameters)


def broyden(problem: Problem, clock: Clock) -> Fields:
    """Self-scaled Broyden, double precision, after Adam for a fifth of the time, as usual."""
    network = _network(problem)
    field = None
    for field in by_gradients(torch.optim.Adam, 1e-2)(problem, lambda: 5 * clock()):
        yield field
    start = field.parameters if field is not None else network.initial(SEED)
    for iterate in self_scaled_broyden(network.energy, start):
        yield network.field(iterate.parameters)


def natural_gradient(problem: Problem, clock: Clock) -> Fields:
    """SPRING with 300 random points a step."""
    network = _network(problem)
    samples = random_samples(network, 300, SEED)
    for iterate in spring(samples, network.initial(SEED), rate=0.1, damping=1e-3, momentum=0.9):
        yield network.field(iterate.parameters)


def gauss_newton(problem: Problem, clock: Clock) -> Fields:
    """Levenberg-Marquardt for networks of half the width, one point an element."""
    network = _network(problem, width=16, degree=1)
    for iterate in levenberg_marquardt(everywhere(network), network.initial(SEED)):
        yield network.field(iterate.parameters)


def dense_gates(problem: Problem, clock: Clock) -> Fields:
    """Gates around random points, in rounds; on the shared mesh."""
    yield from random_gates(Problem(finger_mesh(Design()), problem.material, problem.load), SEED)


def neurons_by_l_bfgs(problem: Problem, clock: Clock) -> Fields:
    """Variable projection: the output layer is exact at every step; on the shared mesh."""
    yield from trained_neurons(Problem(finger_mesh(Design()), problem.material, problem.load), SEED)


def whole(solver: Solver) -> Recipe:
    """One of the project's own solvers, on the shared mesh, evaluated once at its end."""

    def train(problem: Problem, clock: Clock) -> Fields:
        yield solver.solve(Problem(finger_mesh(Design()), problem.material, problem.load)).field

    return train


RECIPES: dict[str, Recipe] = {
    "Adam, 1e-2": by_gradients(torch.optim.Adam, 1e-2),
    "Adam, 1e-2, slopes 0.1/mm through points of the body": by_gradients(torch.optim.Adam, 1e-2, slope=0.1),
    "Adam, 1e-2, output layer exact at the end": by_gradients(torch.optim.Adam, 1e-2, finish=True),
    "SOAP, 1e-2": by_gradients(Soap, 1e-2),
    "L-BFGS": l_bfgs,
    "Adam, then self-scaled Broyden": broyden,
    "SPRING, 300 random points": natural_gradient,
    "Levenberg-Marquardt, width 16": gauss_newton,
    "random gates that do not sum to one, dense exact output layer": dense_gates,
    "pinn-std at twice the spacing, neurons trained by L-BFGS": neurons_by_l_bfgs,
    "pinn-std, preset fast": whole(PinnStdSolver()),
    "pinn-local": whole(PinnLocalSolver()),
}

REMARKS = {
    "Adam, 1e-2": "far from converged: stiffness and bending differ by orders of magnitude",
    "Adam, 1e-2, slopes 0.1/mm through points of the body": (
        "initial neurons through the body gain most, then it stalls"
    ),
    "Adam, 1e-2, output layer exact at the end": "hardly helps: the hidden features limit the accuracy",
    "SOAP, 1e-2": "the best of the gradient methods here; the rate was not tuned",
    "L-BFGS": "line searches stall",
    "Adam, then self-scaled Broyden": "a dense matrix of all parameters; ahead of L-BFGS",
    "SPRING, 300 random points": ("the fastest start from random weights; sampling noise limits the end"),
    "Levenberg-Marquardt, width 16": "still falling, but a step costs the square of the parameters",
    "random gates that do not sum to one, dense exact output layer": (
        "exact output layer, no training: a dense system limits the number of units"
    ),
    "pinn-std at twice the spacing, neurons trained by L-BFGS": (
        "variable projection works, but gains less than twice the units"
    ),
    "pinn-std, preset fast": "random hidden weights, gates that sum to one, sparse exact output layer",
    "pinn-local": "the same with windows instead of gates",
}
"""The lesson of each recipe, in a sentence."""


def main(seconds: float = SECONDS) -> Table:
    """Train by every recipe and write the report."""
    judge = Judge.of()
    problem = Problem(finger_mesh(Design(), settings=MeshSettings(size=TRAINING_SIZE)))
    curves = {}
    for name, recipe in RECIPES.items():
        watch = Watch(judge, seconds)
        try:
            curves[name] = watch.follow(recipe(problem, _clock(watch, seconds)))
        except torch.linalg.LinAlgError:  # the optimiser's matrices are singular: keep the result so far
            curves[name] = watch.curve
    header = ("recipe", "time, s", "L2 at 1/4, %", "at 1/2, %", "L2, %", "von Mises, %", "energy, %")
    rows = [(name, *_columns(curve, seconds)) for name, curve in curves.items() if curve]
    REPORT.write_text(_report(header, rows, seconds))
    table = Table(*header, title=f"Recipes, {seconds:g} s each; written to {REPORT}")
    for row in rows:
        table.add_row(*row)
    return table


def _clock(watch: Watch, seconds: float) -> Clock:
    return lambda: watch.seconds() / seconds


def _columns(curve: list[Judged], seconds: float) -> tuple[str, ...]:
    def error_at(share: float) -> str:
        before = [look.displacement for look in curve if look.seconds <= 1.02 * share * seconds]
        return f"{before[-1]:.2g}" if before else "-"

    last = curve[-1]
    errors = (f"{last.displacement:.2g}", f"{last.von_mises:.2g}", f"{last.energy:+.2g}")
    return f"{last.seconds:.0f}", error_at(0.25), error_at(0.5), *errors


def _report(header: tuple[str, ...], rows: list[tuple[str, ...]], seconds: float) -> str:
    lines = [
        "# Recipes",
        "",
        f"Made by `python -m benchmarks recipes --seconds {seconds:g}` on {datetime.now(UTC):%Y-%m-%d}: "
        f"{platform.machine()}, {torch.get_num_threads()} threads, Python {platform.python_version()}, "
        f"torch {version('torch')}, seed {SEED}.",
        "",
        "Default finger and load; clamp and load hold exactly. Unless a row says otherwise: two modified "
        "MLPs with three gates of 32 neurons, and the energy by the rule of degree 2 on elements of "
        f"{TRAINING_SIZE:g} mm. Errors are relative L2, and the energy is relative, to quadratic finite "
        "elements graded to 0.02 mm at the corners.",
        "",
        "| " + " | ".join(header) + " | remark |",
        "|---|" + "---:|" * (len(header) - 1) + "---|",
        *("| " + " | ".join(row) + f" | {REMARKS.get(row[0], '')} |" for row in rows),
        "",
    ]
    return "\n".join(lines)
