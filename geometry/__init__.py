"""The finger: design, CAD model, markers and the one mesh that every solver shares. Units: mm, degrees.

The names below are imported on first use: `import geometry` is quick and needs neither CadQuery nor Gmsh.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from geometry.cache import cad_files as cad_files
    from geometry.cache import finger_mesh as finger_mesh
    from geometry.errors import OutsideBodyError as OutsideBodyError
    from geometry.errors import ShapeError as ShapeError
    from geometry.errors import UserError as UserError
    from geometry.finger.design import Design as Design
    from geometry.finger.markers import marker_positions as marker_positions
    from geometry.finger.presets import load_design as load_design
    from geometry.finger.presets import parse_overrides as parse_overrides
    from geometry.finger.presets import preset_names as preset_names
    from geometry.finger.section import Section as Section
    from geometry.finger.section import finger_section as finger_section
    from geometry.finger.validation import allowed_range as allowed_range
    from geometry.mesh.point_location import LocatedPoints as LocatedPoints
    from geometry.mesh.quadrature import Quadrature as Quadrature
    from geometry.mesh.quadrature import body_quadrature as body_quadrature
    from geometry.mesh.quadrature import edge_quadrature as edge_quadrature
    from geometry.mesh.settings import MeshSettings as MeshSettings
    from geometry.mesh.triangle_mesh import TriangleMesh as TriangleMesh
    from geometry.mesh.walls import elements_through_thickness as elements_through_thickness
    from geometry.observations import Observations as Observations

_HOME = {
    "Design": "finger.design",
    "LocatedPoints": "mesh.point_location",
    "MeshSettings": "mesh.settings",
    "Observations": "observations",
    "OutsideBodyError": "errors",
    "Quadrature": "mesh.quadrature",
    "Section": "finger.section",
    "ShapeError": "errors",
    "TriangleMesh": "mesh.triangle_mesh",
    "UserError": "errors",
    "allowed_range": "finger.validation",
    "body_quadrature": "mesh.quadrature",
    "cad_files": "cache",
    "edge_quadrature": "mesh.quadrature",
    "elements_through_thickness": "mesh.walls",
    "finger_mesh": "cache",
    "finger_section": "finger.section",
    "load_design": "finger.presets",
    "marker_positions": "finger.markers",
    "parse_overrides": "finger.presets",
    "preset_names": "finger.presets",
}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"geometry.{_HOME[name]}"), name)
