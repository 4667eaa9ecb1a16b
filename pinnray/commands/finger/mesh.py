"""Mesh the finger."""

from pathlib import Path

from pinnray.options.shared import Adapt, FingerOptions, OutputPath, PhysicsOptions
from pinnray.runtime.errors import UserError
from pinnray.runtime.exits import NOT_CONVERGED


def command(
    *,
    finger: FingerOptions = FingerOptions(),
    physics: PhysicsOptions = PhysicsOptions(),
    adapt: Adapt = None,
    out: OutputPath = Path("out/mesh"),
) -> int:
    """Mesh the finger: write the mesh as a VTU and a NumPy file, and a picture.

    Material and load matter only with --adapt.

    Args:
        adapt: Refine the mesh until the estimated error of fem at the markers is below this, mm.
        out: Output folder.
    """
    from pinnray.comparison.figures.mesh_drawing import draw_mesh
    from pinnray.comparison.pipeline.shared_mesh import shared_mesh, tolerance_reached, write_rounds
    from pinnray.comparison.report.output_files import write_mesh
    from pinnray.runtime.stages import Stages

    chosen, settings = finger.read()
    material, load = physics.read()
    if out.is_file():
        raise UserError(f"--out {out}: this is a file; name a folder")
    finger.check_cost(chosen, settings)
    with Stages() as stages:
        triangles, adaptation = shared_mesh(
            chosen, settings, stages, tolerance=adapt, material=material, load=load
        )
    out.mkdir(parents=True, exist_ok=True)
    if adaptation is not None:
        write_rounds(out / "adapt.csv", adaptation)
    write_mesh(out / "mesh.vtu", triangles)
    triangles.save(out / "mesh.npz")
    draw_mesh(triangles).save(out / "mesh.png")
    nodes, area = len(triangles.points), triangles.areas.sum()
    print(f"{nodes} nodes, {len(triangles.triangles)} triangles, area {area:.4f} mm^2")
    for name in ("mesh.vtu", "mesh.npz", "mesh.png", *(["adapt.csv"] if adaptation else [])):
        print(out / name)
    return 0 if tolerance_reached(adaptation) else NOT_CONVERGED
