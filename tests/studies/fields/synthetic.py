"""Fields in closed form in place of solved ones: smooth in the parameters."""

from pathlib import Path

import numpy as np

from pinnray.geometry.finger.presets import load_design
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.lagrange import LagrangeSpace
from pinnray.studies.emulator.inputs import Inputs
from pinnray.studies.fields.snapshots import KnownSamples, Snapshots
from pinnray.studies.sweep.sampling import samples
from pinnray.studies.sweep.study import Study, Value

STROKES = 5

LOADS = {"contact_position": {"from": 30, "to": 60}, "radius": {"from": 4, "to": 16}}


def study(varied: dict[str, object] = LOADS, count: int = 40, seed: int = 0) -> Study:
    return Study(
        name="synthetic",
        solver="fem-nonlinear",
        mesh_size=5.0,
        samples=count,
        strokes=STROKES,
        seed=seed,
        fixed={"load": "cylinder", "stroke": 10.0},
        varied=varied,
    )


def known(given: Study, lost: list[dict[str, Value]] | None = None) -> KnownSamples:
    """The samples of a study as if all had fields."""
    base = {
        name: value for name, value in load_design("default").definition().items() if name not in given.varied
    }
    every, away = samples(given), lost or []
    inputs = Inputs(given, {name: value for name, value in base.items() if name != "name"})
    numbers, reasons = list(range(len(every))), ["no equilibrium"] * len(away)
    return KnownSamples(Path(), inputs, numbers, every, [{}] * len(every), away, reasons)


def field(space: LagrangeSpace, sample: dict[str, Value], share: float) -> FloatArray:
    """Displacements at a share of the stroke, shape (N, 2), mm."""
    x, y = space.nodes.T / 90
    at = float(sample.get("contact_position", 45.0)) / 90
    r = float(sample.get("radius", 5.0)) / 16
    bend = x**2 * (1 + 0.3 * np.sin(4 * at)) * share - 0.2 * r * x**3 * share**2
    dent = 0.1 * np.exp(-(((x - at) / 0.3) ** 2)) * share
    return np.stack([2 * y * bend, -8 * bend - dent], axis=1)


def numbers(sample: dict[str, Value], share: float) -> FloatArray:
    """Force, energy, place and width of the contact."""
    at, r = float(sample.get("contact_position", 45.0)), float(sample.get("radius", 5.0))
    force = 0.3 * share * (1 + share) * (100 - at) / 50
    return np.array([0.1 * force, -force, 0.5 * force * share, at + share, 0.1 * r * np.sqrt(share)])


def snapshots(given: Study, lost: list[dict[str, Value]] | None = None) -> Snapshots:
    """The fields of a study's samples."""
    own = known(given, lost)
    shares = np.arange(1, STROKES + 1) / STROKES
    space = LagrangeSpace(own.meshes.mesh, 2)
    nodal = [[field(space, sample, share) for share in shares] for sample in own.samples]
    values = [[numbers(sample, share) for share in shares] for sample in own.samples]
    return Snapshots(own, np.array(nodal), np.array(values))
