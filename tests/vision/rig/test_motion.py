"""When the load grows, and what an open shutter sees of it."""

import numpy as np
import pytest

from pinnray.vision.rig.motion import Motion


@pytest.mark.parametrize("shutter", [0.0, 0.3, 0.9])
@pytest.mark.parametrize("moving", [0, 1, 7])
def test_frames_at_rest_and_held_see_no_motion(moving, shutter):
    motion = Motion(rest=3, moving=moving, held=4, shutter=shutter)
    loads = [motion.exposed(frame, 5) for frame in range(len(motion))]
    assert [load.tolist() for load in loads[:3]] == [[0.0]] * 3
    assert [load.tolist() for load in loads[-4:]] == [[1.0]] * 4
    assert len(motion) == 7 + moving


def test_the_load_grows_at_constant_speed_between():
    motion = Motion(rest=3, moving=7, held=4, shutter=0.5)
    means = [motion.exposed(frame, 5).mean() for frame in range(3, 10)]
    np.testing.assert_allclose(np.diff(means), 1 / 7.5)
    assert motion.travel(5) == pytest.approx(0.5 / 7.5)
    assert motion.travel(1) == 0
    assert 0 < means[0] < means[-1] < 1


def test_a_finger_that_goes_back_rests_as_long_as_before():
    motion = Motion(rest=3, moving=7, held=4, back=7, shutter=0.5)
    assert len(motion) == 24
    means = np.array([motion.exposed(frame, 5).mean() for frame in range(24)])
    np.testing.assert_allclose(means[14:21], 1 - means[3:10], atol=1e-12)
    assert not means[21:].any()
