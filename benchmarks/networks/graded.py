"""Networks against finite elements that are graded to the corners.

The reference has quadratic elements graded to 0.01 mm at the corners and an eighth of the contact's width
there; on the default finger halving its other elements changes its von Mises stress by 0.3 % and its
displacement by 0.0005 %. `fem` on the shared mesh stands beside the networks. "Own estimate" is the solver's.

- `pinn`: the default finger, several spacings, three seeds: mean and range.
- `designs`: default settings, twelve random admissible fingers; ten minutes.
- `drawings`: default settings, the drawings of the tests and the preset csiro; fifteen minutes.
- `contact`: a rigid cylinder, neo-Hookean, stroke 10 mm, finite elements at finite strain; twenty minutes.
- `trained`: the preset `trained`, three seeds, the random fingers and a patch; forty minutes.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from rich.table import Table

from benchmarks.tables import DOCS
from pinnray.comparison.evaluation.evaluation import Evaluation
from pinnray.comparison.evaluation.metrics import force_error
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.drawing.load import finger_from_file
from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.finger.presets import load_design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.runtime.tables import terminal_table
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.registry import make_solver
from pinnray.solvers.solution import Solution
from pinnray.solvers.solver import Solver
from tests.geometry.mesh.test_mesher import random_design

DATA = DOCS.parent / "tests" / "data"
DESIGNS = 12
NETWORKS = {"pinn-std": {}, "pinn-std, preset local": {"preset": "local"}}
"""Settings by name."""
HEADER = (
    *("finger", "solver", "time, s", "L2, %", "von Mises, %", "markers, mm", "force, %", "energy, %"),
    *("own estimate, %", "converged"),
)


def pinn() -> Table:
    """Spacings and seeds."""
    spacings = {"pinn-std": (1.6, 1.1, 0.8), "pinn-std, preset local": (1.0, 0.7, 0.5)}
    named = {
        f"{kind}, spacing {spacing}": [
            make_solver("pinn-std", **own, wall_spacing=spacing, seed=seed) for seed in range(3)
        ]
        for kind, own in NETWORKS.items()
        for spacing in spacings[kind]
    }
    compared = Compared(Design(), MeshSettings(corner_size=0.002))
    rows = [
        ("default", name, *compared.cells(*solvers))
        for name, solvers in {"fem": [make_solver("fem")], **named}.items()
    ]
    return table("Networks on the default finger, mean (range)", rows)


def designs() -> Table:
    """Random fingers."""
    return table("Networks on random fingers", default_settings(random_fingers()))


def drawings() -> Table:
    """Drawings of the tests."""
    files = [*sorted(DATA.glob("compliant-finray/*.stp")), DATA / "csiro-finger" / "finray_test_vol.msh"]
    fingers: dict[str, Finger] = {path.stem: finger_from_file(path) for path in files}
    rows = default_settings(fingers | {"preset csiro": load_design("csiro")})
    return table("Networks on drawings", rows)


def contact() -> Table:
    """A rigid cylinder at finite strain."""
    rows = []
    for radius in (5.0, 10.0):
        fine = MeshSettings(corner_size=0.02, contact_size=0.1)
        compared = Compared(Design(), fine, "neo-hookean", kind="cylinder", radius=radius)
        rows += beside("fem-nonlinear", compared, f"default, radius {radius:g} mm")
    return table("A rigid cylinder on the default finger", rows)


def trained() -> Table:
    """All weights trained."""
    rows = []
    for name, finger in {"default": Design(), **random_fingers()}.items():
        compared = Compared(finger)
        for seed in range(3 if name == "default" else 1):
            solver = make_solver("pinn-std", preset="trained", seed=seed)
            rows.append((name, f"trained, seed {seed}", *compared.cells(solver)))
    patch = Compared(Design(), kind="patch").cells(make_solver("pinn-std", preset="trained"))
    rows.append(("default, patch", "trained, seed 0", *patch))
    return table("pinn-std --preset trained", rows)


def random_fingers() -> dict[str, Finger]:
    """Random admissible fingers by their seeds."""
    return {str(seed): random_design(seed) for seed in range(DESIGNS)}


def default_settings(fingers: Mapping[str, Finger]) -> Iterator[Sequence[str]]:
    """Rows of `fem` and the networks on fingers."""
    for name, finger in fingers.items():
        yield from beside("fem", Compared(finger), name)


def beside(fem: str, compared: "Compared", name: str) -> Iterator[Sequence[str]]:
    """Rows of finite elements on the shared mesh and of the networks on a finger."""
    yield name, fem, *compared.cells(make_solver(fem))
    for label, own in NETWORKS.items():
        yield name, label, *compared.cells(make_solver("pinn-std", **own))


class Compared:
    """A finger under a load on the shared mesh, with its reference."""

    def __init__(
        self, finger: Finger, fine: MeshSettings | None = None, law: str = "linear", **load: Any
    ) -> None:
        """Solve for the reference; `fine` has its elements, `load` the values of the load."""
        fine = fine or MeshSettings(corner_size=0.01, contact_size=finger.contact_width / 8)
        self.problem = Problem(finger_mesh(finger), Material(law=law), Load(**load))
        graded = replace(self.problem, mesh=finger_mesh(finger, settings=fine))
        exact = make_solver("fem" if law == "linear" else "fem-nonlinear").solve(graded)
        self.reference = Evaluation.of(exact, self.problem.mesh)

    def cells(self, *solvers: Solver) -> list[str]:
        """Solve, and compare: the figures of one solver, or mean and range of several."""
        solutions = [solver.solve(self.problem) for solver in solvers]
        columns = np.transpose([self.figures(solution) for solution in solutions])
        texts = [f"{column.mean():.2g}" if np.isfinite(column).all() else "" for column in columns]
        if len(solvers) > 1:
            ranges = [f" ({column.min():.2g} to {column.max():.2g})" for column in columns]
            texts = [text and text + spread for text, spread in zip(texts, ranges, strict=True)]
        return [*texts, "yes" if all(solution.status.converged for solution in solutions) else "no"]

    def figures(self, solution: Solution) -> tuple[float, ...]:
        """Time, s, and differences from the reference, % and mm, as `HEADER` has them."""
        own = Evaluation.of(solution, self.problem.mesh)
        to = own.differences_from(self.reference)
        estimated = solution.history.get("estimated_error", [np.nan])[-1]
        energy = own.energy / self.reference.energy - 1
        shares = (force_error(own, self.reference, self.problem.load), energy, float(estimated))
        return (
            *(float(solution.stats["seconds"]), 100 * to.displacement.rel_l2, 100 * to.von_mises.rel_l2),
            *(to.mae_markers, *(100 * share for share in shares)),
        )


def table(title: str, rows: Iterator[Sequence[str]] | Sequence[Sequence[str]]) -> Table:
    """The table for the terminal."""
    return terminal_table(f"{title}, against graded finite elements", HEADER, rows, left=HEADER[:2])
