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
    from pinnray.camera import calibrate as calibrate
    from pinnray.camera import film_forces as film_forces
    from pinnray.camera import rig as rig
    from pinnray.camera import track as track
    from pinnray.comparison.evaluation.evaluation import Evaluation as Evaluation
    from pinnray.comparison.report.comparison import Comparison as Comparison
    from pinnray.designers import optimise as optimise
    from pinnray.designers import predict as predict
    from pinnray.designers import predict_field as predict_field
    from pinnray.designers import sweep as sweep
    from pinnray.functions import benchmark as benchmark
    from pinnray.functions import compare as compare
    from pinnray.functions import crossval as crossval
    from pinnray.functions import load_drawing as load_drawing
    from pinnray.functions import mesh as mesh
    from pinnray.functions import solve as solve
    from pinnray.functions import solver as solver
    from pinnray.geometry.drawing.drawn_finger import DrawnFinger as DrawnFinger
    from pinnray.geometry.finger.design import Design as Design
    from pinnray.geometry.finger.presets import load_design as load_design
    from pinnray.geometry.finger.presets import preset_names as preset_names
    from pinnray.geometry.mesh.triangle_mesh import TriangleMesh as TriangleMesh
    from pinnray.geometry.observations import Observations as Observations
    from pinnray.measurements import load_measurements as load_measurements
    from pinnray.robots.export import Exported as Exported
    from pinnray.runtime.errors import OutsideBodyError as OutsideBodyError
    from pinnray.runtime.errors import UserError as UserError
    from pinnray.simulators import export as export
    from pinnray.solution import Solution as Solution
    from pinnray.solvers.load import Load as Load
    from pinnray.solvers.material import Material as Material
    from pinnray.solvers.materials.presets import MATERIALS as MATERIALS
    from pinnray.solvers.problem import Problem as Problem
    from pinnray.solvers.registry import solver_names as solver_names
    from pinnray.studies.benchmark.benchmark import Benchmark as Benchmark
    from pinnray.studies.crossval.result import CrossvalResult as CrossvalResult
    from pinnray.studies.fields.prediction import PredictedField as PredictedField
    from pinnray.studies.optimum.search import Optimum as Optimum
    from pinnray.vision.calibration.camera_calibration import Calibration as Calibration
    from pinnray.vision.rig.exposure import Exposure as Exposure
    from pinnray.vision.rig.motion import Motion as Motion
else:
    from pinnray.runtime.lazy_exports import lazy_exports

    __getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)
