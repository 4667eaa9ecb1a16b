"""Fingers and their coarse meshes, each made once for all tests."""

from functools import cache

import pytest

from pinnray.geometry import Design, MeshSettings, TriangleMesh, load_design, preset_names

COARSE = MeshSettings(size=1.0, coarsening=2)

CASES: dict[str, Design] = {
    "no ribs": Design(rib_count=0),  # one cavity
    "one rib": Design(rib_count=1),
    "leaning to the base": Design(rib_angle=-15),  # the other sense of the slope
    "fillets": Design(fillet_radius=1.0),  # arcs in the outline
    "thin ribs": Design(rib_thickness=0.5),  # thinner than the mesh size
    "front markers": Design(marker_layout="front"),
    "contact near the base": Design(contact_position=3, contact_width=5),
    "contact on the tip": Design(contact_position=84, contact_width=1),
    "longer, six ribs": Design(N=6, H=110),  # type: ignore[call-arg]
} | {f"preset {name}": load_design(name) for name in preset_names() if name != "csiro"}
"""Wedges with the right angle at the front, whose closed forms tests know."""


@cache
def coarse_mesh(case: str) -> TriangleMesh:
    from pinnray.geometry.mesh.mesher import build_mesh

    return build_mesh(CASES[case], COARSE)


@pytest.fixture(params=CASES)
def case(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def design(case: str) -> Design:
    return CASES[case]


@pytest.fixture
def mesh(case: str) -> TriangleMesh:
    return coarse_mesh(case)


@pytest.fixture
def default_mesh() -> TriangleMesh:
    return coarse_mesh("preset default")
