"""Time and memory that a fine mesh takes, told before it is made."""

from collections.abc import Sequence

from pinnray.geometry.cache import mesh_sizes
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.mesh.element_size import estimated_triangles
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.runtime.errors import UserError
from pinnray.runtime.machine import free_memory_gb
from pinnray.solvers.solver import Cost, Solver, Traits

MESH, EXPERIMENT = Cost(per_triangle=40), Cost(per_triangle=300)
"""Time of making the mesh, and of a virtual experiment on it."""

MAX_SECONDS = 300.0
"""Time that needs no consent."""

USABLE = 0.8
"""Share of the free memory that needs no consent."""


def mesh_price(
    triangles: int, solvers: Sequence[Solver] = (), *, simulated: bool = False
) -> tuple[float, float]:
    """Time of a mesh and of what is done on it, s, as far as a coarser mesh takes less, and memory, GB.

    Args:
        triangles: Number of triangles.
        solvers: What it is made for.
        simulated: Whether it is for a virtual experiment as well.
    """
    costs = [*[EXPERIMENT] * simulated, *(Traits.of(each).cost for each in solvers)]
    seconds = sum(cost.of_mesh(triangles) for cost in [MESH, *costs])
    return seconds, 1e-6 * triangles * max((cost.kilobytes for cost in costs), default=0.0)


def check_mesh_cost(
    finger: Finger, settings: MeshSettings | None, solvers: Sequence[Solver] = (), *, simulated: bool = False
) -> None:
    """Refuse a mesh that takes long or much memory, unless it is the one of the finger's file.

    Args:
        finger: The finger.
        settings: Element sizes, as for `finger_mesh`.
        solvers: What the mesh is made for.
        simulated: Whether it is for a virtual experiment as well.

    Raises:
        UserError: With the price.
    """
    if (settings := mesh_sizes(finger, settings)) is None:
        return
    triangles, free = estimated_triangles(finger, settings), free_memory_gb()
    seconds, memory = mesh_price(triangles, solvers, simulated=simulated)
    if seconds > MAX_SECONDS or memory > USABLE * free:
        raise UserError(
            f"--mesh-size {settings.size:g} gives about {triangles:,} triangles, which take about "
            f"{seconds / 60:.0f} min and {memory:.1f} GB ({free:.1f} GB are free); "
            "go on with --yes, or take a coarser mesh"
        )
