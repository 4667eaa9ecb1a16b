"""Walks through the visible entities of a DXF drawing, its blocks and polylines taken apart."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
from ezdxf.lldxf.const import DXFError

from pinnray.geometry.drawing.formats.drawing import place
from pinnray.runtime.errors import UserError

MOST = 100_000
"""Largest number of entities in all insertions."""


class Drawn(NamedTuple):
    """An entity that is neither block nor polyline, and the layer on which it shows."""

    entity: Any
    layer: str


class Walk:
    """The entities of a document that count.

    What is in a block on layer `0` is on the layer of the block's insertion. Left out is what is invisible,
    on a layer that is off or frozen, or in a block whose insertion is invisible or on a frozen layer.
    """

    def __init__(self, document: Any) -> None:
        self._document = document
        self._count = 0
        self._hidden = {
            layer.dxf.name.lower()
            for layer in document.layers
            if layer.is_off() or layer.is_frozen() or layer.dxf.name.lower() == "defpoints"
        } | {"defpoints"}
        self._frozen = {layer.dxf.name.lower() for layer in document.layers if layer.is_frozen()}

    def __iter__(self) -> Iterator[Drawn]:
        yield from self._shown(list(self._document.modelspace()), "0", ())

    def _shown(self, entities: list[Any], around: str, within: tuple[str, ...]) -> Iterator[Drawn]:
        """Entities with their layers.

        Args:
            entities: Of a layout, block or polyline.
            around: Layer of the insertion or polyline that they are in.
            within: Names of the blocks that they are in.
        """
        for entity in entities:
            own = layer_of(entity)
            layer = around if own == "0" else own
            if _is_invisible(entity):
                continue
            if entity.dxftype() == "INSERT":
                if layer.lower() not in self._frozen:
                    yield from self._inserted(entity, layer, within)
            elif layer.lower() in self._hidden:
                continue
            elif entity.dxftype() in ("LWPOLYLINE", "POLYLINE"):
                with sound(entity, layer):
                    parts = list(entity.virtual_entities())
                yield from self._shown(parts, layer, within)
            else:
                yield Drawn(entity, layer)

    def _inserted(self, entity: Any, layer: str, within: tuple[str, ...]) -> Iterator[Drawn]:
        name = str(entity.dxf.get("name", ""))
        block = entity.block()
        remedy = "delete its insertion, or bind the external reference"
        if block is None:
            raise UserError(f"the block {name!r} is not in the file; {remedy}")
        if block.block.is_xref:
            raise UserError(
                f"the block {name!r} is in the file {block.block.dxf.get('xref_path')!r}; {remedy}"
            )
        if name.lower() in within:
            raise UserError(f"the block {name!r} is within itself; delete that insertion")

        def skipped(part: Any, reason: str) -> None:
            if layer_of(part).lower() not in self._hidden:
                raise UserError(
                    f"cannot place the {part.dxftype()} of the block {name!r}: {reason}; explode the block"
                )

        times = max(1, entity.dxf.get("row_count", 1)) * max(1, entity.dxf.get("column_count", 1))
        self._count += times * (1 + len(block))
        if self._count > MOST:
            raise UserError(
                f"its blocks make more than {MOST} entities, the last {name!r}; draw each curve once"
            )
        with sound(entity, layer):
            single = list(entity.multi_insert()) if times > 1 else [entity]
            parts = [
                part for each in single for part in each.virtual_entities(skipped_entity_callback=skipped)
            ]
        yield from self._shown(parts, layer, (*within, name.lower()))


@contextmanager
def sound(entity: Any, layer: str) -> Iterator[None]:
    """Turns any exception of ezdxf at an entity into one line that says which one."""
    try:
        yield
    except (UserError, MemoryError):
        raise
    except Exception as error:  # a damaged entity can make ezdxf raise anything
        told = isinstance(error, DXFError | ValueError) and str(error)
        reason = str(error).splitlines()[0].rstrip(".") if told else "a value is missing or wrong"
        raise UserError(
            f"the {entity.dxftype()}{_where(entity)} on layer {layer!r} is damaged: {reason}; draw it anew, "
            "or freeze that layer"
        ) from None


def _is_invisible(entity: Any) -> bool:
    try:
        return bool(entity.dxf.get("invisible", 0))
    except DXFError:  # of a kind that ezdxf does not know
        return False


def layer_of(entity: Any) -> str:
    """The layer of an entity; `0`, the format's default, where it has none."""
    try:
        return str(entity.dxf.layer)
    except DXFError:  # of a kind that ezdxf does not know
        return "0"


def _where(entity: Any) -> str:
    """Place of an entity in words, as far as it says."""
    for name in ("start", "center", "location", "insert"):
        if entity.dxf.hasattr(name):
            point = entity.dxf.get(name)
            return f" at {place(np.array([point[0], point[1]]))}"
    for name in ("control_points", "fit_points"):
        for point in list(getattr(entity, name, ()))[:1]:
            return f" at {place(np.array([point[0], point[1]]))}"
    return ""
