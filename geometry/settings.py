"""How fine the mesh is."""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from geometry.design import one_line
from geometry.errors import UserError


class MeshSettings(BaseModel):
    """Element sizes of the mesh, mm.

    Sizes are upper limits: walls and ribs that are thin for `size` get the smaller elements that put at least
    three across them.

    Raises:
        UserError: One line with the setting, the value and what would be right.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    size: float = Field(default=0.25, ge=0.02, le=20, description="Element size in the walls and ribs [mm]")
    coarsening: float = Field(
        default=4.0,
        ge=1,
        le=20,
        description="How many times larger elements may grow in solid parts such as the tip",
    )
    growth: float = Field(
        default=0.2,
        ge=0.02,
        le=2,
        description="Growth of the element size per distance from where it is fine",
    )
    contact_size: float | None = Field(
        default=None, ge=1e-4, le=20, description="Element size at the contact's ends and middle [mm]"
    )
    corner_size: float | None = Field(
        default=None,
        ge=1e-4,
        le=20,
        description="Element size at the re-entrant corners and at both ends of the clamped base [mm]",
    )

    def __init__(self, **values: Any) -> None:
        try:
            super().__init__(**values)
        except ValidationError as error:
            raise UserError(one_line(error, MeshSettings)) from None
