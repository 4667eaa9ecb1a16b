"""Force over stroke of the default finger, at finite strain and linear.

The indenter is a 2 mm patch that slides without friction. Forces are for the whole depth of the finger.
"""

from pinnray.geometry import MeshSettings, finger_mesh, load_design
from pinnray.solvers.problem import Load, Material, Problem
from pinnray.solvers.registry import make_solver


def main() -> None:
    """Press the paper's finger by 10 mm in load steps and print the force at each."""
    design = load_design("default")
    mesh = finger_mesh(design, settings=MeshSettings(size=1.0))
    load = Load(kind="patch", displacement=(None, -10.0))
    problem = Problem(mesh, Material(law="neo-hookean"), load)
    solution = make_solver("fem-nonlinear").solve(problem)
    linear = make_solver("fem").solve(Problem(mesh, Material(), load))

    print("stroke mm  force N  linear model N")
    for fraction, reaction in zip(
        solution.history["load_fraction"], solution.history["reaction_y"], strict=True
    ):
        # Reactions are per mm of depth.
        force = abs(reaction) * design.depth
        linear_force = fraction * abs(linear.reaction[1]) * design.depth
        print(f"{10 * fraction:9.2f}  {force:7.3f}  {linear_force:14.3f}")

    # 5.10 N at 10 mm. The tolerance of 0.05 N leaves room for other meshers.
    assert abs(force - 5.10) < 0.05


if __name__ == "__main__":
    main()
