"""Settings of the mesh: element sizes."""

from pinnray.geometry.finger.parameters import CheckedModel, bounded


class MeshSettings(CheckedModel):
    """Element sizes of the mesh, mm.

    Sizes are upper limits: walls and ribs that are thin for `size` get the smaller elements that put at least
    three across them.
    """

    size: float = bounded(0.25, 0.02, 20, "Largest element in the walls and ribs", "mm")
    coarsening: float = bounded(
        4.0, 1, 20, "How many times larger elements may grow in solid parts such as the tip"
    )
    growth: float = bounded(0.2, 0.02, 2, "Growth of the element size per distance")
    contact_size: float | None = bounded(
        None, 1e-4, 20, "Element size at the contact's ends and middle; none: no grading", "mm"
    )
    corner_size: float | None = bounded(
        None, 1e-4, 20, "Element size at re-entrant corners and the base's ends; none: no grading", "mm"
    )
