"""The project from Python: `import pinnray as pr`. Lengths in mm, angles in degrees, stress in MPa.

    comparison = pr.compare("slender", ["fem", "pinn-std"])
    comparison.table()
    comparison.plot("von_mises")

`Design`, the mesh, a solution and a comparison show themselves in a notebook and have `plot`. What is named
here is imported on first use, so that this import is quick and needs no finite-element library.
Imports every other package; none imports this one.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from compare.crossval.result import CrossvalResult as CrossvalResult
    from geometry.drawing.drawn_finger import DrawnFinger as DrawnFinger
    from geometry.errors import UserError as UserError
    from geometry.finger.design import Design as Design
    from geometry.finger.presets import load_design as load_design
    from geometry.finger.presets import preset_names as preset_names
    from geometry.mesh.triangle_mesh import TriangleMesh as TriangleMesh
    from geometry.observations import Observations as Observations
    from pinnray.comparison import Comparison as Comparison
    from pinnray.designers import optimise as optimise
    from pinnray.designers import predict as predict
    from pinnray.designers import sweep as sweep
    from pinnray.functions import compare as compare
    from pinnray.functions import crossval as crossval
    from pinnray.functions import load_drawing as load_drawing
    from pinnray.functions import mesh as mesh
    from pinnray.functions import solve as solve
    from pinnray.functions import solver as solver
    from pinnray.functions import track as track
    from solvers.problem import Load as Load
    from solvers.problem import Material as Material
    from solvers.problem import Problem as Problem
    from solvers.registry import solver_names as solver_names
    from solvers.solution import Solution as Solution
else:
    from geometry.lazy_exports import lazy_exports

    __getattr__, __all__ = lazy_exports(__name__, __file__)
