"""Types of a finger's parameters as keywords of a function, for editors and type checkers."""

from typing import Literal, TypedDict


class FingerKeywords(TypedDict, total=False):
    """The parameters of `pinnray.geometry.finger.parameters.Parameters`; each may be left out.

    The paper's symbols, such as N for `rib_count`, are understood too.
    """

    name: str
    height: float
    base_width: float
    depth: float
    rib_angle: float
    tip_length: float
    rib_count: int
    rib_thickness: float
    front_thickness: float
    back_thickness: float
    base_thickness: float
    base_tilt: float
    rib_reference: Literal["front", "base"]
    rib_start: float | None
    rib_pitch: float | None
    tip_radius: float
    foot_height: float
    slot_width: float
    slot_opening: float
    slot_height: float
    lip_thickness: float
    fillet_radius: float
    contact_position: float | None
    contact_width: float
    marker_layout: Literal["front", "joints"]
    marker_count: int
    marker_diameter: float
    marker_height: float
