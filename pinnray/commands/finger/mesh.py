"""Mesh the finger."""

from pathlib import Path

from pinnray.options.shared import FingerOptions, OutputPath
from pinnray.runtime.errors import UserError


def command(*, finger: FingerOptions = FingerOptions(), out: OutputPath = Path("out/mesh")) -> int:
    """Mesh the finger: write the mesh as a VTU and a NumPy file, and a picture.

    Args:
        out: Output folder.
    """
    from pinnray.comparison.report.output_files import write_mesh
    from pinnray.geometry.cache import finger_mesh
    from pinnray.runtime.stages import Stages

    chosen, settings = finger.read()
    if out.is_file():
        raise UserError(f"--out {out}: this is a file; name a folder")
    finger.check_cost(chosen, settings)
    with Stages() as stages, stages.stage("mesh"):
        triangles = finger_mesh(chosen, settings=settings)
    out.mkdir(parents=True, exist_ok=True)
    write_mesh(out / "mesh.vtu", triangles)
    triangles.save(out / "mesh.npz")
    triangles.plot().save(out / "mesh.png")
    nodes, area = len(triangles.points), triangles.areas.sum()
    print(f"{nodes} nodes, {len(triangles.triangles)} triangles, area {area:.4f} mm^2")
    print(out / "mesh.vtu", out / "mesh.npz", out / "mesh.png", sep="\n")
    return 0
