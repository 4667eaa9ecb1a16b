"""The finger: design, CAD model, markers and the one mesh that every solver shares. Units: mm, degrees.

The names below are imported on first use: `import geometry` is quick and needs neither CadQuery nor Gmsh.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from geometry.across import elements_across as elements_across
    from geometry.admissible import admissible_range as admissible_range
    from geometry.cache import cad_files as cad_files
    from geometry.cache import finger_mesh as finger_mesh
    from geometry.design import Design as Design
    from geometry.errors import OutsideBodyError as OutsideBodyError
    from geometry.errors import ShapeError as ShapeError
    from geometry.errors import UserError as UserError
    from geometry.locate import Location as Location
    from geometry.markers import marker_positions as marker_positions
    from geometry.mesh import TriangleMesh as TriangleMesh
    from geometry.observations import Observations as Observations
    from geometry.presets import load_design as load_design
    from geometry.presets import parse_overrides as parse_overrides
    from geometry.presets import preset_names as preset_names
    from geometry.quadrature import Quadrature as Quadrature
    from geometry.quadrature import body_quadrature as body_quadrature
    from geometry.quadrature import edge_quadrature as edge_quadrature
    from geometry.section import Section as Section
    from geometry.section import finger_section as finger_section
    from geometry.settings import MeshSettings as MeshSettings

_HOME = {
    "Design": "design",
    "Location": "locate",
    "MeshSettings": "settings",
    "Observations": "observations",
    "OutsideBodyError": "errors",
    "Quadrature": "quadrature",
    "Section": "section",
    "ShapeError": "errors",
    "TriangleMesh": "mesh",
    "UserError": "errors",
    "admissible_range": "admissible",
    "body_quadrature": "quadrature",
    "cad_files": "cache",
    "edge_quadrature": "quadrature",
    "elements_across": "across",
    "finger_mesh": "cache",
    "finger_section": "section",
    "load_design": "presets",
    "marker_positions": "markers",
    "parse_overrides": "presets",
    "preset_names": "presets",
}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"geometry.{_HOME[name]}"), name)
