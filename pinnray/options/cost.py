"""Time and memory that a fine mesh takes, told before it is made."""

from collections.abc import Collection
from dataclasses import dataclass

from geometry.cache import mesh_sizes
from geometry.errors import UserError
from geometry.finger.finger import Finger
from geometry.machine_memory import free_memory_gb
from geometry.mesh.element_size import estimated_triangles
from geometry.mesh.settings import MeshSettings

MESH, EXPERIMENT = "mesh", "virtual experiment"

MICROSECONDS = {
    MESH: 40,
    EXPERIMENT: 380,
    "fem": 180,
    "fem-nonlinear": 690,
    "fem-asm": 110,
    "fem-id": 1650,
    "gp": 70,
    "statfem": 140,
}
"""Time per triangle of the default finger on one core, with 42,000 triangles; `fem` with 354,000.

The time of networks hardly depends on the mesh, and `fem-3d` estimates its own.
"""

KILOBYTES = 30
"""Largest memory of a run per triangle, from the same run; factors and error estimates take most of it."""

MAX_SECONDS = 300.0
"""Time that needs no consent."""

USABLE = 0.8
"""Share of the free memory that needs no consent."""

COARSER = 1.25
"""Ratio of the element sizes that are tried for the advice."""


@dataclass(frozen=True)
class MeshCost:
    """The price of a mesh.

    Attributes:
        triangles: Number of triangles.
        parts: Keys of `MICROSECONDS`: what is done with it.
    """

    triangles: int
    parts: Collection[str]

    @property
    def seconds(self) -> float:
        """Time, s."""
        return 1e-6 * self.triangles * sum(MICROSECONDS.get(part, 0) for part in self.parts)

    @property
    def memory_gb(self) -> float:
        """Memory, GB, of the solvers."""
        solves = any(part != MESH for part in self.parts)
        return 1e-6 * self.triangles * KILOBYTES if solves else 0.0

    def fits(self, free_gb: float) -> bool:
        """Whether it needs no consent."""
        return self.seconds <= MAX_SECONDS and self.memory_gb <= USABLE * free_gb


def check_mesh_cost(finger: Finger, settings: MeshSettings | None, parts: Collection[str]) -> None:
    """Refuse a mesh that takes long or much memory, unless it is the one of the finger's file.

    Args:
        finger: The finger.
        settings: Element sizes, as for `finger_mesh`.
        parts: Names of solvers, and `EXPERIMENT` if one is simulated.

    Raises:
        UserError: With the price and a size that costs less.
    """
    if (settings := mesh_sizes(finger, settings)) is None:
        return
    free, parts = free_memory_gb(), [MESH, *parts]
    cost = MeshCost(estimated_triangles(finger, settings), parts)
    if cost.fits(free):
        return
    size, coarser = settings.size, cost
    while not coarser.fits(free) and coarser.triangles > 1000:
        size = float(f"{COARSER * size:.2g}")
        coarser = MeshCost(estimated_triangles(finger, settings.model_copy(update={"size": size})), parts)
    raise UserError(
        f"--mesh-size {settings.size:g} gives about {cost.triangles:,} triangles, which take about "
        f"{cost.seconds / 60:.0f} min and {cost.memory_gb:.1f} GB ({free:.1f} GB are free); "
        f"go on with --yes, or take a coarser mesh, such as --mesh-size {size:g}"
    )
