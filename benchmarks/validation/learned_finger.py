"""A finger that is measured once: ten unseen presses, after three presses and a weighed one, and without.

`python -m benchmarks.validation.learned_finger [SEEDS]` prints errors of the force, half intervals and how
often they hold. The modulus is known to 30 %. Some 70 s a seed.
"""

import sys
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from pinnray.comparison.evaluation.evaluation import evaluated
from pinnray.comparison.evaluation.truths import Truth
from pinnray.comparison.evaluation.virtual_experiment import simulate
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.learned import Learned
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.observations import Observations
from pinnray.solvers.fem.identification import FemIdSolver
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.solution import Solution

NOISE, TAUGHT, UNSEEN, KNOWN = 0.01, 4, 10, Material(young="11.4±3.42", law="neo-hookean")


class Press(NamedTuple):
    """A problem with what a camera sees of it, and the force, N."""

    problem: Problem
    force: float


def presses(seed: int) -> list[Press]:
    """Of one finger of other walls, ratio and modulus, at other places, by patches and cylinders."""
    rng = np.random.default_rng(seed)
    young, walls = 11.4 * np.exp(0.3 * rng.normal()), 1 + 0.05 * rng.normal(size=3)
    scaled = dict(zip(("front_thickness", "back_thickness", "rib_thickness"), walls.tolist(), strict=True))
    poisson = float(np.clip(0.45 + 0.03 * rng.normal(), 0.38, 0.488))
    patch = Truth("one-finger", "pressed by {:.4g} mm", scaled=scaled, poisson=poisson)
    found = []
    for number in range(TAUGHT + UNSEEN):
        design, stroke = Design(contact_position=rng.uniform(22, 50)), float(rng.uniform(3, 9))
        round_one = rng.uniform() > 0.5
        truth = replace(patch, radius=8.0, friction=0.3, slope=0.0) if round_one else patch
        load = Load("patch", stroke=stroke)
        meshes = [finger_mesh(design, settings=MeshSettings(size=size)) for size in (0.5, 1.0)]
        true = simulate(Problem(meshes[0], Material(young=young), load, finger=design), truth=truth)
        moved, force = evaluated(true, meshes[0]).marker_displacement, -design.depth * float(true.reaction[1])
        noise, weighed = NOISE * rng.normal(size=moved.shape), force * (1 + 0.02 * rng.normal())
        scale = (weighed, 0.02 * weighed) if number == TAUGHT - 1 else None
        seen = Observations(design.markers, moved + noise, NOISE, simulated=True, weighed=scale)
        found.append(Press(Problem(meshes[1], KNOWN, load.as_mean(), seen, design), force))
    return found


def scored(solution: Solution, force: float) -> tuple[float, float, bool]:
    """Error of the force and half its interval over the true force, N, and whether it holds that."""
    assert solution.identified is not None
    value, low, high = (solution.depth * each for each in solution.identified.force)
    return abs(value / force - 1), (high - low) / 2 / force, low <= force <= high


def main() -> None:
    """Print the medians of each seed."""
    for seed in range(int(sys.argv[1]) if len(sys.argv) > 1 else 1):
        given, solver = presses(seed), FemIdSolver()
        learned: Learned | None = None
        for press in given[:TAUGHT]:
            found = solver.solve(replace(press.problem, learned=learned)).identified
            learned = found.learned if found else None
        for name, known in (("alone", None), ("learned", learned)):
            rows = [scored(solver.solve(replace(p.problem, learned=known)), p.force) for p in given[TAUGHT:]]
            error, half, held = np.array(rows).T
            print(
                f"{seed} {name}: error {np.median(error):.1%} (at most {error.max():.1%}), half "
                f"{np.median(half):.1%}, held {held.sum():.0f} of {UNSEEN}",
                flush=True,
            )


if __name__ == "__main__":
    main()
