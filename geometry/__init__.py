"""The finger: design, CAD model, markers and the one mesh that every solver shares. Units: mm, degrees.

The names below are imported on first use: `import geometry` is quick and needs neither CadQuery nor Gmsh.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from geometry.cache import cad_files as cad_files
    from geometry.cache import finger_mesh as finger_mesh
    from geometry.errors import OutsideBodyError as OutsideBodyError
    from geometry.errors import ShapeError as ShapeError
    from geometry.errors import UserError as UserError
    from geometry.finger.design import Design as Design
    from geometry.finger.finger import Finger as Finger
    from geometry.finger.markers import marker_positions as marker_positions
    from geometry.finger.presets import load_design as load_design
    from geometry.finger.presets import parse_overrides as parse_overrides
    from geometry.finger.presets import preset_names as preset_names
    from geometry.finger.section import finger_section as finger_section
    from geometry.finger.validation import allowed_range as allowed_range
    from geometry.mesh.boundary import elements_through_thickness as elements_through_thickness
    from geometry.mesh.point_location import LocatedPoints as LocatedPoints
    from geometry.mesh.quadrature import Quadrature as Quadrature
    from geometry.mesh.quadrature import body_quadrature as body_quadrature
    from geometry.mesh.quadrature import edge_quadrature as edge_quadrature
    from geometry.mesh.settings import MeshSettings as MeshSettings
    from geometry.mesh.triangle_mesh import TriangleMesh as TriangleMesh
    from geometry.observations import Observations as Observations
    from geometry.section.loop import Loop as Loop
    from geometry.section.section import Section as Section
else:
    from geometry.lazy_exports import lazy_exports

    __getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)
