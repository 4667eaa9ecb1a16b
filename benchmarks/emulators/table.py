"""The table of emulators: `python -m benchmarks.emulators.table KNOWN UNSEEN MINUTES`.

KNOWN is the folder of a sweep of docs/examples/loads.toml, UNSEEN that of other loads, as `make bench
ARGS=fields` makes them in `out/`. The network of the family is trained for so many minutes on one core.
"""

import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import torch
from rich.table import Table

from benchmarks.__main__ import show
from benchmarks.emulators.family import Loads, answers, trained
from benchmarks.emulators.galerkin import ReducedBody
from benchmarks.emulators.network import ModeNetwork
from geometry.arrays import FloatArray
from solvers.cylinder_contact import CylinderContact
from solvers.problem import Problem
from studies.fields.emulator import FieldEmulator, fitted_fields, grip_force, places
from studies.fields.snapshots import KnownSamples, Snapshots
from studies.sweep.study import Value

HEADINGS = ("displacement", "", "force", "", "von Mises", "", "answer, ms", "made in, s", "none")

Answer = Callable[[dict[str, Value], float], tuple[FloatArray, float] | None]
"""Displacement (N, 2), mm, and force along the stroke, N/mm, of a load at a share of the full stroke."""


def main(known: Path, unseen: Path, minutes: float) -> None:
    """Print the table."""
    samples, others = (Snapshots.load(KnownSamples.of(each)) for each in (known, unseen))
    table = Table(
        "", "displacement", "", "force", "", "von Mises field", "", "answer, ms", "made in, s", "none"
    )
    start = time.perf_counter()
    emulator = fitted_fields(samples)
    made = time.perf_counter() - start
    for name, (answer, seconds) in _kinds(samples, emulator, minutes):
        off, spent, none = _compared(answer, others, emulator)
        cells = [f"{np.quantile(column, level):.2%}" for column in off.T for level in (0.5, 0.95)]
        table.add_row(name, *cells, f"{1e3 * spent:.1f}", f"{made + seconds:.0f}", str(none))
        made = 0.0
        print(name, *cells, file=sys.stderr)
    show(table)


def _kinds(
    samples: Snapshots, emulator: FieldEmulator, minutes: float
) -> Iterator[tuple[str, tuple[Answer, float]]]:
    inputs = samples.inputs

    def by_process(sample: dict[str, Value], share: float) -> tuple[FloatArray, float]:
        found = emulator.predict(sample, share * emulator.stroke)
        return found.nodal, grip_force(found.reaction, found.problem.load)

    yield "modes, Gaussian processes", (by_process, 0.0)
    start = time.perf_counter()
    network = ModeNetwork(samples)

    def by_network(sample: dict[str, Value], share: float) -> tuple[FloatArray, float]:
        nodal, numbers = network.path(places(inputs, [sample])[0], share)
        return nodal, grip_force(numbers[:2], inputs.physics(sample)[1])

    yield "modes, five small networks", (by_network, time.perf_counter() - start)
    start = time.perf_counter()
    lame = inputs.physics(samples.samples[0])[0].lame
    body = ReducedBody(samples, lame)
    print(f"{len(body.vectors)} modes, {len(body.cells)} triangles")

    def by_galerkin(sample: dict[str, Value], share: float) -> tuple[FloatArray, float] | None:
        guess = emulator.predict(sample, share * emulator.stroke)
        load = inputs.physics(sample)[1].model_copy(update={"position": sample["contact_position"]})
        shape = samples.known.meshes.base.replaced(contact_position=sample["contact_position"])
        problem = Problem(guess.mesh, guess.problem.material, load, finger=shape)
        found = body.pressed(CylinderContact.of(problem, body.space), share, guess.nodal)
        return None if found is None else (found[0], grip_force(found[1], load))

    yield "the same, then reduced Galerkin", (by_galerkin, time.perf_counter() - start)
    start = time.perf_counter()
    family = trained(samples.space, lame, emulator.stroke, minutes)

    def by_family(sample: dict[str, Value], share: float) -> tuple[FloatArray, float]:
        values = [np.array([float(sample[name])]) for name in ("contact_position", "radius", "direction")]
        nodal, force = answers(
            family, Loads(values[0], values[1], values[2], np.array([share])), emulator.stroke
        )
        return nodal[0], float(force[0])

    yield "a network of the family, by energy alone", (by_family, time.perf_counter() - start)


def _compared(answer: Answer, true: Snapshots, emulator: FieldEmulator) -> tuple[FloatArray, float, int]:
    """Relative errors (n, 3) of displacement, force and stress, seconds an answer, and loads without one."""
    reader, points = emulator.reader, emulator.mesh.points
    errors, spent, none = [], [], 0
    for sample, path, numbers in zip(true.samples, true.nodal, true.numbers, strict=True):
        material, load = true.inputs.physics(sample)
        counted = reader.counted(points, float(sample["contact_position"]))
        for share, nodal, wanted in zip(true.shares, path, numbers, strict=True):
            start = time.perf_counter()
            found = answer(sample, share)
            spent.append(time.perf_counter() - start)
            if found is None:
                none += 1
                continue
            stress, own = (
                reader.stress(points, each, emulator.law, material.lame)[counted]
                for each in (nodal, found[0])
            )
            force = grip_force(wanted[:2], load)
            errors.append(
                (
                    np.linalg.norm(found[0] - nodal) / np.linalg.norm(nodal),
                    abs(found[1] - force) / abs(force),
                    np.linalg.norm(own - stress) / np.linalg.norm(stress),
                )
            )
    return np.array(errors), float(np.median(spent)), none


if __name__ == "__main__":
    torch.set_num_threads(1)
    main(Path(sys.argv[1]), Path(sys.argv[2]), float(sys.argv[3]))
