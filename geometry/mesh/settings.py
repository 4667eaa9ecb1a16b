"""How fine the mesh is."""

from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

from geometry.errors import UserError
from geometry.finger.error_messages import validation_message
from geometry.finger.parameters import bounded


class MeshSettings(BaseModel):
    """Element sizes of the mesh, mm.

    Sizes are upper limits: walls and ribs that are thin for `size` get the smaller elements that put at least
    three across them.

    Raises:
        UserError: One line with the setting, the value and what would be right.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    size: float = bounded(0.25, 0.02, 20, "mm", "", "Largest element in the walls and ribs")
    coarsening: float = bounded(
        4.0, 1, 20, "", "", "How many times larger elements may grow in solid parts such as the tip"
    )
    growth: float = bounded(0.2, 0.02, 2, "", "", "Growth of the element size per distance")
    contact_size: float | None = bounded(
        None, 1e-4, 20, "mm", "", "Element size at the contact's ends and middle; none: no grading"
    )
    corner_size: float | None = bounded(
        None, 1e-4, 20, "mm", "", "Element size at re-entrant corners and the base's ends; none: no grading"
    )

    def __init__(self, **values: Any) -> None:
        try:
            super().__init__(**values)
        except ValidationError as error:
            raise UserError(validation_message(error, MeshSettings)) from None
