"""Models for robot simulators: the chain against MuJoCo's mechanics, tetrahedra as VTK reads them."""

import numpy as np
import pytest
import pyvista

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.robots.chain import MM, Chain
from pinnray.robots.mjcf import chain_mjcf, gripper_mjcf
from pinnray.robots.simulation import chain_front
from pinnray.robots.solid_files import write_solid
from pinnray.robots.solid_mesh import SolidMesh
from pinnray.robots.springs import Springs
from tests.solvers.conftest import SHORT

DENSITY = 1200.0


@pytest.fixture(scope="module")
def section():
    return finger_mesh(SHORT, settings=MeshSettings(size=2.0), across=1)


@pytest.fixture(scope="module")
def front(section):
    points = section.points[np.unique(section.boundary("front"))]
    return points[points[:, 0].argsort()]


@pytest.fixture(scope="module")
def chain(section, front):
    return Chain.of(section, front, 5, DENSITY)


@pytest.fixture(scope="module")
def springs(chain):
    """Any that are positive: their vibrations, in the rows of the mass matrix's root."""
    rows = np.linalg.cholesky(chain.inertia).T
    lengths = np.linalg.norm(rows, axis=1)
    frequencies = np.linspace(100.0, 600.0, chain.hinges + 1)
    return Springs(rows / lengths[:, None], lengths**2 * frequencies**2, frequencies)


def test_the_chain_has_the_mass_of_the_finger_and_the_slopes_of_its_places(section, front, chain):
    assert chain.masses.sum() == pytest.approx(DENSITY * MM**3 * section.areas.sum() * section.depth)
    q = (
        0.05
        * np.arange(1, chain.hinges + 2)
        * (-1.0) ** np.arange(chain.hinges + 1)
        * [MM / 0.05, 1, 1, 1, 1, 1]
    )
    _, slopes = chain.placed(q, MM * front)
    for which, step in enumerate(1e-6 * np.eye(len(q))):
        ends = [chain.placed(q + sign * step, MM * front)[0] for sign in (1, -1)]
        assert (ends[0] - ends[1]) / 2e-6 == pytest.approx(slopes[..., which], abs=1e-9)
    moved = chain.placed(q, MM * front)[0] - MM * front
    assert chain.bent_as(MM * front, moved) == pytest.approx(q, abs=1e-6)


def test_mujoco_has_the_masses_springs_and_places_of_the_chain(front, chain, springs):
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(chain_mjcf("short", chain, springs, 2.0, SHORT.depth, 0.3))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    assert inertia == pytest.approx(chain.inertia, rel=1e-6, abs=1e-6 * chain.inertia.max())
    data.qpos[:] = q = 0.03 * np.array([MM / 0.03, 1, -2, 3, 1, -1])
    data.qvel[:] = speed = 2 * q
    mujoco.mj_forward(model, data)
    assert chain_front(chain, MM * front)(model, data) == pytest.approx(chain.placed(q, MM * front)[0])
    assert data.qfrc_spring == pytest.approx(
        -springs.rows.T @ (springs.stiffnesses * (springs.rows @ q)), rel=1e-6
    )
    # A vibration's damping is its stiffness times the loss factor over its frequency.
    resistance = springs.rows.T @ (0.3 * springs.stiffnesses / springs.frequencies * (springs.rows @ speed))
    assert data.qfrc_damper == pytest.approx(-resistance, rel=1e-6)


def test_the_tetrahedra_fill_the_body_and_name_the_nodes_of_its_boundaries(section, tmp_path):
    body = SolidMesh.of(section, 2)
    write_solid(tmp_path, body)
    grid = pyvista.read(tmp_path / "finger.vtk")
    assert grid.volume == pytest.approx(MM**3 * section.areas.sum() * section.depth)
    assert grid.volume == pytest.approx(body.volume)
    assert pyvista.read(tmp_path / "finger.stl").volume == pytest.approx(body.volume)  # normals outward
    base, front = grid.points[grid["base"] == 1], grid.points[grid["front"] == 1]
    assert len(base) == 3 * len(np.unique(section.boundary("base")))
    assert np.abs(base[:, 0]).max() < 1e-9
    assert np.abs(front[:, 1]).max() < 1e-9
    assert np.ptp(front[:, 2]) == pytest.approx(MM * section.depth)


def test_a_gripper_of_two_fingers_closes_on_its_object_in_its_own_time_step(tmp_path, chain, springs):
    """It is nearly at rest after a second, and both press alike; MuJoCo's own time step is twice as long."""
    mujoco = pytest.importorskip("mujoco")
    (tmp_path / "chain.xml").write_text(chain_mjcf("short", chain, springs, 2.0, SHORT.depth, 0.3))
    place = np.array([SHORT.contact_abscissa, 0.0])
    scene = gripper_mjcf("gripper", "chain.xml", place, 6.0, SHORT.depth, 2.0)
    (tmp_path / "gripper.xml").write_text(scene)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "gripper.xml"))
    assert model.opt.timestep <= 5e-4  # of 1 ms, an object of 15 mm was held for two seconds only
    assert model.ntendon == 2 * (chain.hinges + 1)
    data = mujoco.MjData(model)
    for step in range(1000):
        data.ctrl[:] = 2.5e-3 * min(1.0, step / 400)
        mujoco.mj_step(model, data)
    assert not any(each.number for each in data.warning)
    assert np.abs(data.qvel).max() < 0.02
    left, right = data.actuator_force
    assert left == pytest.approx(right, rel=1e-3)
    assert left > 0.1
    assert np.abs(data.body("object").xpos[1:]).max() < 1e-4
