"""A finger from its definition, whether it has parameters or was drawn."""

from collections.abc import Mapping
from typing import Any

from geometry.drawing.drawn_finger import DrawnFinger
from geometry.finger.design import Design
from geometry.finger.finger import Finger


def finger_from(definition: Mapping[str, Any]) -> Finger:
    """The finger that `Finger.definition` describes.

    Raises:
        UserError: If the parameters break a rule.
    """
    if "section" in definition:
        return DrawnFinger.from_definition(definition)
    return Design(**definition)
