"""Models for robot simulators: the chain against MuJoCo's mechanics, tetrahedra against Gmsh's reading."""

import gmsh
import numpy as np
import pytest

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.robots.chain import MM, Chain
from pinnray.robots.mjcf import Damping, chain_mjcf
from pinnray.robots.simulation import chain_front
from pinnray.robots.solid_files import write_msh
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
    damping = Damping(0.3, springs.frequencies[0])
    model = mujoco.MjModel.from_xml_string(chain_mjcf("short", chain, springs, 2.0, SHORT.depth, damping))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    assert inertia == pytest.approx(chain.inertia, rel=1e-6, abs=1e-6 * chain.inertia.max())
    data.qpos[:] = q = 0.03 * np.array([MM / 0.03, 1, -2, 3, 1, -1])
    data.qvel[:] = speed = 2 * q
    mujoco.mj_forward(model, data)
    assert chain_front(chain, MM * front)(model, data) == pytest.approx(chain.placed(q, MM * front)[0])
    assert data.qfrc_spring == pytest.approx(-springs.matrix @ q, rel=1e-6)
    # A vibration's damping is its stiffness times the loss factor over its frequency.
    resistance = springs.rows.T @ (0.3 * springs.stiffnesses / springs.frequencies * (springs.rows @ speed))
    assert data.qfrc_damper == pytest.approx(-resistance, rel=1e-6)


def test_gmsh_reads_the_body_with_its_groups(tmp_path, section):
    body = SolidMesh.of(section, 3)
    assert body.volume == pytest.approx(MM**3 * section.areas.sum() * section.depth)
    write_msh(tmp_path / "finger.msh", body)
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(tmp_path / "finger.msh"))
        groups = {gmsh.model.getPhysicalName(*each): each for each in gmsh.model.getPhysicalGroups()}
        assert groups == {"base": (2, 1), "front": (2, 2), "body": (3, 3)}
        tags, points, _ = gmsh.model.mesh.getNodes()
        place = dict(zip(tags.tolist(), points.reshape(-1, 3), strict=True))
        assert len(tags) == len(body.points)
        assert len(gmsh.model.mesh.getElementsByType(4)[0]) == len(body.tetrahedra)
        for name, length in (
            ("base", section.boundary_length("base")),
            ("front", section.boundary_length("front")),
        ):
            (entity,) = gmsh.model.getEntitiesForPhysicalGroup(*groups[name])
            (nodes,) = gmsh.model.mesh.getElements(2, entity)[2]
            a, b, c = np.moveaxis(np.array([place[node] for node in nodes.tolist()]).reshape(-1, 3, 3), 1, 0)
            normals = np.cross(b - a, c - a) / 2
            assert np.linalg.norm(normals, axis=1).sum() == pytest.approx(MM**2 * length * section.depth)
            outward = {"base": -normals[:, 0], "front": normals[:, 1]}[name]
            assert (outward > 0).all()
    finally:
        gmsh.finalize()
