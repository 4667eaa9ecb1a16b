"""Parts of a Gmsh mesh with materials of their own."""

import json
import pickle

import gmsh
import numpy as np
import pytest

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.drawing.description import Description, load_description
from pinnray.geometry.drawing.drawn_finger import DrawnFinger, description_lines
from pinnray.geometry.drawing.load import finger_from_file
from pinnray.geometry.mesh.mesher import session
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.runtime.errors import UserError

WHERE = {"markers": [[50, -2]], "materials": {"Strip": {"young": 2e5, "poisson": 0.3}}}


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """A beam of 100 mm by 10 mm whose upper 4 mm are the part `strip`, the rest `links`."""
    path = tmp_path_factory.mktemp("parts") / "parts.msh"
    with session():
        geo = gmsh.model.geo
        places = [(0, 0), (0, -4), (0, -10), (100, -10), (100, -4), (100, 0), (44, 0), (40, 0)]
        points = [geo.addPoint(x, y, 0, 2.0) for x, y in places]
        rim = [geo.addLine(a, b) for a, b in zip(points, points[1:] + points[:1], strict=True)]
        between = geo.addLine(points[1], points[4])
        strip = geo.addPlaneSurface([geo.addCurveLoop([rim[0], between, *rim[4:]])])
        links = geo.addPlaneSurface([geo.addCurveLoop([*rim[1:4], -between])])
        geo.synchronize()
        for name, curves in (("base", rim[:2]), ("contact", [rim[6]])):
            gmsh.model.addPhysicalGroup(1, curves, name=name)
        for name, surface in (("strip", strip), ("links", links)):
            gmsh.model.addPhysicalGroup(2, [surface], name=name)
        gmsh.model.mesh.generate(2)
        gmsh.write(str(path))
    return path


def test_a_physical_surface_has_its_material(file):
    finger = finger_from_file(file, Description(**WHERE))
    assert finger.mesh is not None
    assert finger.mesh.moduli is not None
    y = finger.mesh.at_centroids().points[:, 1]
    upper = y > -4
    np.testing.assert_array_equal(finger.mesh.moduli[upper], np.tile([2e5, 0.3], (upper.sum(), 1)))
    assert not finger.mesh.moduli[~upper].any()
    assert finger.mesh.areas[upper].sum() == pytest.approx(400)
    assert ("Material of Strip", "", "E = 200000 MPa, Poisson's ratio 0.3") in finger.facts()
    np.testing.assert_array_equal(finger_mesh(finger).moduli, finger.mesh.moduli)


def test_the_materials_stay_with_the_finger(file, tmp_path):
    finger = finger_from_file(file, Description(**WHERE))
    assert pickle.loads(pickle.dumps(finger)).digest == finger.digest
    (tmp_path / "lines.toml").write_text(description_lines(finger))
    assert load_description(tmp_path / "lines.toml").materials == Description(**WHERE).materials
    assert finger.digest != finger_from_file(file, Description(markers=((50, -2),))).digest
    alone = DrawnFinger.from_definition(json.loads(json.dumps(finger.definition())))
    with pytest.raises(UserError, match="materials of parts are on the file's own mesh"):
        finger_mesh(alone)  # which the definition lacks


def test_what_would_lose_the_materials_is_refused(file):
    finger = finger_from_file(file, Description(**WHERE))
    with pytest.raises(UserError, match="materials of parts are on the file's own mesh"):
        finger_mesh(finger, settings=MeshSettings(size=1.0))
    with pytest.raises(UserError, match="materials of parts are on the file's own mesh"):
        finger.at_contact(finger.contact_abscissa + 1)


@pytest.mark.parametrize(
    ("materials", "said"),
    [
        ({"strap": {"young": 1.0, "poisson": 0.3}}, "no physical surface 'strap'.*there are strip, links"),
        (
            {"strip": {"young": 1.0, "poisson": 0.3}, "STRIP": {"young": 2.0, "poisson": 0.3}},
            "overlaps another one",
        ),
    ],
)
def test_a_material_of_no_part_is_refused(file, materials, said):
    with pytest.raises(UserError, match=said):
        finger_from_file(file, Description(**{**WHERE, "materials": materials}))
