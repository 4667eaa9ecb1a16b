"""The branches of loading and unloading, and intervals that hold for a material that loses energy."""

import numpy as np
import pytest
from scipy.integrate import trapezoid

from pinnray.film.filmed_force import viscoelastic_forces
from pinnray.film.loading_path import LoadingPath
from pinnray.solvers.identification.tracker import ForceReading
from pinnray.solvers.solution import Estimated
from pinnray.vision.rig.motion import Motion
from tests.vision.fingers import PRESSED

WHOLE = np.array(PRESSED["front"])[0]
MOTION = Motion(rest=6, moving=30, held=10, back=30)
SHARES = MOTION.load(np.arange(len(MOTION)) + MOTION.shutter / 2)


def elastic(shares):
    """Forces, N, of a finger that stiffens, as printed ones do."""
    return np.outer(4 * np.asarray(shares) + np.asarray(shares) ** 2, [1.0, -0.1])


def followed(path, shares=SHARES, noise=0.003, hidden=0.0):
    rng = np.random.default_rng(1)
    for number, share in enumerate(shares):
        moved = share * WHOLE + rng.normal(0, noise, WHOLE.shape)
        yield path.follow(
            number / 30, moved, np.full(WHOLE.shape, noise), rng.uniform(size=len(WHOLE)) >= hidden
        )


@pytest.mark.parametrize("hidden", [0.0, 0.3])
@pytest.mark.parametrize("noise", [0.001, 0.01])
def test_every_frame_is_on_its_branch_but_for_those_at_a_turn(noise, hidden):
    branches = [loading.branch for loading in followed(LoadingPath(0.0), noise=noise, hidden=hidden)]
    assert set(branches[:6]) == {"rest"}
    assert set(branches[7:36]) == {"loading"}
    assert set(branches[41:46]) == {"hold"}  # a tenth of the second of the loading later
    assert set(branches[48:76]) == {"unloading"}


def test_a_second_loading_is_a_reloading_until_it_goes_farther():
    shares = [0, 0, *np.linspace(0, 0.6, 20), *np.linspace(0.6, 0.2, 20), *np.linspace(0.2, 1.0, 41)]
    branches = [loading.branch for loading in followed(LoadingPath(0.0), shares)]
    assert set(branches[45:60]) == {"reloading"}
    assert set(branches[65:]) == {"loading"}


@pytest.mark.parametrize(("assumed", "least", "most"), [(0.1, 0.9, 1.0), (0.0, 0.0, 0.3)])
def test_intervals_hold_on_the_way_back_if_the_loss_is_given(assumed, least, most):
    """The truth is a standard linear solid of a loss of 10 %, the interval knows no more than this number."""
    path, forces, inside = LoadingPath(assumed), elastic(SHARES), []
    truth = viscoelastic_forces(elastic, MOTION, 0.1)
    for number, loading in enumerate(followed(path)):
        force, across = (Estimated(each, *sorted((0.97 * each, 1.03 * each))) for each in forces[number])
        reading = ForceReading(force, across, Estimated(35.0, 34.0, 36.0), 1.0, 1, 0.0, "")
        found = path.widened(reading, loading)
        if loading.branch == "unloading":
            pairs = zip((found.force, found.tangential_force), truth[number], strict=True)
            inside.append([low <= true <= high for (_, low, high), true in pairs])
    assert least <= np.mean(inside) <= most


@pytest.mark.parametrize("loss", [0.02, 0.1, 0.4])
def test_a_filmed_cycle_loses_what_it_should(loss):
    motion = Motion(rest=6, moving=200, held=1, back=200)
    shares = motion.load(np.arange(len(motion)) + motion.shutter / 2)
    forces, top = viscoelastic_forces(elastic, motion, loss)[:, 0], int(shares.argmax())
    loaded, unloaded = trapezoid(forces[: top + 1], shares[: top + 1]), -trapezoid(forces[top:], shares[top:])
    assert 1 - unloaded / loaded == pytest.approx(loss, rel=0.03)  # a frame is a hundredth of the way
    assert forces.max() == pytest.approx(elastic([1.0])[0, 0], rel=1e-3)
