"""Walks through the visible entities of a DXF drawing, its blocks and polylines taken apart."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from ezdxf.lldxf.const import DXFError

from pinnray.runtime.errors import UserError

MOST = 100_000
"""Largest number of entities in all insertions."""


Drawn = tuple[Any, str]
"""An entity that is neither block nor polyline, and the layer on which it shows."""


class Walk:
    """The entities of a document that count.

    What is in a block on layer `0` is on the layer of the block's insertion. Left out is what is invisible,
    on a layer that is off or frozen, or in a block whose insertion is invisible or on a frozen layer.
    """

    def __init__(self, document: Any) -> None:
        self._document = document
        self._count = 0
        self._frozen = {layer.dxf.name.lower() for layer in document.layers if layer.is_frozen()}
        off = {layer.dxf.name.lower() for layer in document.layers if layer.is_off()}
        self._hidden = self._frozen | off | {"defpoints"}

    def __iter__(self) -> Iterator[Drawn]:
        yield from self._shown(self._document.modelspace(), "0", ())

    def _shown(self, entities: Iterable[Any], around: str, within: tuple[str, ...]) -> Iterator[Drawn]:
        """Entities with their layers.

        Args:
            entities: Of a layout, block or polyline.
            around: Layer of the insertion or polyline that they are in.
            within: Names of the blocks that they are in.
        """
        for entity in entities:
            kind, layer = entity.dxftype(), str(_attribute(entity, "layer", "0"))
            layer = around if layer == "0" else layer
            hidden = self._frozen if kind == "INSERT" else self._hidden
            if _attribute(entity, "invisible", 0) or layer.lower() in hidden:
                continue
            if kind == "INSERT":
                name = str(entity.dxf.get("name", ""))
                yield from self._shown(self._parts(entity, layer, within), layer, (*within, name.lower()))
            elif kind in ("LWPOLYLINE", "POLYLINE"):
                with sound(entity, layer):
                    parts = list(entity.virtual_entities())
                yield from self._shown(parts, layer, within)
            else:
                yield entity, layer

    def _parts(self, insert: Any, layer: str, within: tuple[str, ...]) -> list[Any]:
        """The entities of all copies of a block that an insertion makes."""
        name, block = str(insert.dxf.get("name", "")), insert.block()
        if block is None or block.block.is_xref:
            raise UserError(
                f"the block {name!r} is not in the file; delete its insertion, or bind the external reference"
            )
        if name.lower() in within:
            raise UserError(f"the block {name!r} is within itself; delete that insertion")

        def skipped(part: Any, reason: str) -> None:
            if str(_attribute(part, "layer", "0")).lower() not in self._hidden:
                raise UserError(
                    f"cannot place the {part.dxftype()} of the block {name!r}: {reason}; explode the block"
                )

        times = max(1, insert.dxf.get("row_count", 1)) * max(1, insert.dxf.get("column_count", 1))
        self._count += times * (1 + len(block))
        if self._count > MOST:
            raise UserError(
                f"its blocks make more than {MOST} entities, the last {name!r}; draw each curve once"
            )
        with sound(insert, layer):
            copies = insert.multi_insert() if times > 1 else [insert]
            return [
                part for each in copies for part in each.virtual_entities(skipped_entity_callback=skipped)
            ]


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
            f"a {entity.dxftype()} on layer {layer!r} is damaged: {reason}; draw it anew, "
            "or freeze that layer"
        ) from None


def _attribute(entity: Any, name: str, default: object) -> Any:
    try:
        return entity.dxf.get(name, default)
    except DXFError:  # of a kind that ezdxf does not know
        return default
