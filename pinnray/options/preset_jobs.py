"""Defaults of mesh, load and solvers that a preset brings with it."""

from typing import Literal, NamedTuple

from pinnray.geometry.mesh.settings import MeshSettings


class JobDefaults(NamedTuple):
    """Element sizes if the preset has its own, and the default kind of load and solvers."""

    mesh: MeshSettings | None = None
    load: Literal["mean", "point", "patch"] = "mean"
    solvers: str = "fem,fem-nonlinear,pinn-std,pinn-asm,fem-asm,fem-id,pinn-id,gp"


JOBS = {"paper": JobDefaults(MeshSettings(size=0.0823, coarsening=1), "point", "fem,pinn-std,pinn-asm")}
"""By preset. The paper moves one point, trains at the nodes of a uniform mesh, and compares three solvers.

It has 90,959 nodes on its finger; this size comes nearest, with 91,006.
"""


def job_defaults(preset: str | None) -> JobDefaults:
    """The defaults of a job with a preset of the solvers, or without one."""
    return JOBS.get(preset or "", JobDefaults())
