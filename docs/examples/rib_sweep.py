"""The Fin Ray effect over the number of ribs.

A cylinder presses the front face by 10 mm along -y. If the finger wraps around it, its tip moves the other
way, along +y. Law and load decide whether it does: with two ribs the apex moves by +3.15 mm under the
cylinder and +3.38 mm under a patch that slides, but by -1.09 mm under the default load, which does not slide
along the finger, and by +0.98 mm under that load in the linear law, which knows no large rotations.
"""

from pinnray.geometry import MeshSettings, finger_mesh, load_design
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.registry import make_solver

CYLINDER = Load(kind="cylinder", radius=5.0, displacement=(0.0, -10.0))


def main() -> None:
    """Solve fingers with two, four and six ribs and print the displacement of the apex."""
    print("ribs  apex u mm  apex v mm  force N")
    apex_v = {}
    for rib_count in (2, 4, 6):
        design = load_design("default", {"rib_count": rib_count})
        mesh = finger_mesh(design, settings=MeshSettings(size=1.0))
        solution = make_solver("fem-nonlinear").solve(Problem(mesh, Material(law="neo-hookean"), CYLINDER))
        ((u, v),) = solution.displacement([[design.height, 0.0]])
        apex_v[rib_count] = v
        force = -solution.reaction[1] * design.depth
        print(f"{rib_count:4d}  {u:9.3f}  {v:9.3f}  {force:7.2f}")

    # Two ribs: 3.15 mm along +y. The tolerance of 0.03 mm leaves room for other meshers.
    assert abs(apex_v[2] - 3.15) < 0.03


if __name__ == "__main__":
    main()
