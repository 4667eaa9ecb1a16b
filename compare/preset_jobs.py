"""What else a preset of a solver asks of a job, where the command line does not say otherwise."""

from typing import Literal, NamedTuple

from geometry.settings import MeshSettings


class JobDefaults(NamedTuple):
    """Element sizes and kind of load of a job that leaves them open."""

    mesh: MeshSettings = MeshSettings()
    load: Literal["mean", "point", "patch"] = "mean"


JOBS = {"paper": JobDefaults(MeshSettings(size=0.0823, coarsening=1), "point")}
"""By preset. The paper moves one point, and trains at the nodes of a uniform mesh.

It has 90,959 nodes on its finger; this size comes nearest, with 91,006.
"""


def job_defaults(preset: str | None) -> JobDefaults:
    """The defaults of a job with a preset of the solvers, or without one."""
    return JOBS.get(preset or "", JobDefaults())
