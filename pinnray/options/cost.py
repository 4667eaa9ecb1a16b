"""Time and memory that a fine mesh takes, told before it is made."""

from collections.abc import Sequence
from dataclasses import dataclass

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


@dataclass(frozen=True)
class MeshCost:
    """The price of a mesh.

    Attributes:
        triangles: Number of triangles.
        solvers: What it is made for.
        simulated: Whether it is for a virtual experiment as well.
    """

    triangles: int
    solvers: Sequence[Solver] = ()
    simulated: bool = False

    @property
    def seconds(self) -> float:
        """Time, s, as far as a coarser mesh takes less."""
        costs = [MESH, *[EXPERIMENT] * self.simulated, *(Traits.of(each).cost for each in self.solvers)]
        return sum(cost.of_mesh(self.triangles) for cost in costs)

    @property
    def memory_gb(self) -> float:
        """Memory, GB, of the solver that takes most."""
        costs = [*[EXPERIMENT] * self.simulated, *(Traits.of(each).cost for each in self.solvers)]
        return 1e-6 * self.triangles * max((cost.kilobytes for cost in costs), default=0.0)

    def fits(self, free_gb: float) -> bool:
        """Whether it needs no consent."""
        return self.seconds <= MAX_SECONDS and self.memory_gb <= USABLE * free_gb


def check_mesh_cost(
    finger: Finger,
    settings: MeshSettings | None,
    solvers: Sequence[Solver] = (),
    *,
    simulated: bool = False,
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
    free = free_memory_gb()
    cost = MeshCost(estimated_triangles(finger, settings), solvers, simulated)
    if not cost.fits(free):
        raise UserError(
            f"--mesh-size {settings.size:g} gives about {cost.triangles:,} triangles, which take about "
            f"{cost.seconds / 60:.0f} min and {cost.memory_gb:.1f} GB ({free:.1f} GB are free); "
            "go on with --yes, or take a coarser mesh"
        )
