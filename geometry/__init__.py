"""The finger: design, CAD model, markers and the one mesh that every solver shares. Units: mm, degrees.

The names below are imported on first use: `import geometry` is quick and needs neither CadQuery nor Gmsh.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pinnray.geometry.cache import cad_files as cad_files
    from pinnray.geometry.cache import finger_mesh as finger_mesh
    from pinnray.geometry.finger.design import Design as Design
    from pinnray.geometry.finger.markers import marker_positions as marker_positions
    from pinnray.geometry.finger.presets import load_design as load_design
    from pinnray.geometry.finger.presets import parse_overrides as parse_overrides
    from pinnray.geometry.finger.presets import preset_names as preset_names
    from pinnray.geometry.finger.section import finger_section as finger_section
    from pinnray.geometry.mesh.boundary import elements_through_thickness as elements_through_thickness
    from pinnray.geometry.mesh.quadrature import body_quadrature as body_quadrature
    from pinnray.geometry.mesh.quadrature import edge_quadrature as edge_quadrature
    from pinnray.geometry.mesh.settings import MeshSettings as MeshSettings
    from pinnray.geometry.mesh.triangle_mesh import TriangleMesh as TriangleMesh
    from pinnray.geometry.observations import Observations as Observations
    from pinnray.geometry.section.section import Section as Section
    from pinnray.runtime.errors import OutsideBodyError as OutsideBodyError
    from pinnray.runtime.errors import UserError as UserError
else:
    from pinnray.runtime.lazy_exports import lazy_exports

    __getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)
