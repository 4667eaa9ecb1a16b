"""Opens a DXF file, and says in which unit it is."""

import io
import logging
from pathlib import Path
from typing import Any

import ezdxf
from ezdxf import recover
from ezdxf.audit import AuditError
from ezdxf.lldxf.const import DXFError

from pinnray.geometry.drawing.formats.drawing import UNITS, Scale
from pinnray.runtime.errors import UserError

logging.getLogger("ezdxf").addHandler(logging.NullHandler())  # else its notes go to the standard error

SURVEY_FOOT = 1200 / 3937 * 1000

HEADER_UNITS = {
    **{1: ("in", 25.4), 2: ("ft", 304.8), 3: ("miles", 1609344.0), 4: ("mm", 1.0), 5: ("cm", 10.0)},
    **{6: ("m", 1000.0), 7: ("kilometres", 1e6), 8: ("microinches", 2.54e-5), 9: ("mil", 0.0254)},
    **{10: ("yd", 914.4), 11: ("angstroms", 1e-7), 12: ("nanometres", 1e-6), 13: ("um", 1e-3)},
    **{14: ("dm", 100.0), 15: ("decametres", 1e4), 16: ("hectometres", 1e5), 17: ("gigametres", 1e12)},
    **{18: ("astronomical units", 149597870700e3), 19: ("light years", 9.4607304725808e18)},
    **{20: ("parsecs", 3.0856775814913673e19), 21: ("US survey feet", SURVEY_FOOT)},
    **{22: ("US survey inches", SURVEY_FOOT / 12), 23: ("US survey yards", 3 * SURVEY_FOOT)},
    **{24: ("US survey miles", 5280 * SURVEY_FOOT)},
}
"""Names and lengths, mm, of the units by `$INSUNITS` of the header."""

LOSSES = {
    *(AuditError.FOUND_TAG_OUTSIDE_SECTION, AuditError.REMOVED_UNSUPPORTED_SECTION),
    *(AuditError.REMOVED_INVALID_GRAPHIC_ENTITY, AuditError.REMOVED_ENTITY_WITH_INVALID_OWNER_HANDLE),
    *(AuditError.UNDEFINED_BLOCK, AuditError.INVALID_BLOCK_REFERENCE_CYCLE, AuditError.UNDEFINED_BLOCK_NAME),
    *(AuditError.INVALID_INTEGER_VALUE, AuditError.INVALID_FLOATING_POINT_VALUE),
    *(AuditError.INVALID_EXTRUSION_VECTOR, AuditError.INVALID_MAJOR_AXIS, AuditError.INVALID_VERTEX_COUNT),
    *(AuditError.INVALID_SPLINE_DEFINITION, AuditError.INVALID_SPLINE_CONTROL_POINT_COUNT),
    *(AuditError.INVALID_SPLINE_FIT_POINT_COUNT, AuditError.INVALID_SPLINE_KNOT_VALUE_COUNT),
    *(AuditError.INVALID_SPLINE_WEIGHT_COUNT, AuditError.INVALID_ELLIPSE_RATIO),
    *(AuditError.MISSING_ENDSEC_TAG, AuditError.MODELSPACE_NOT_FOUND, AuditError.INVALID_MESH_DATA),
}
"""Repairs that leave out or change what is drawn."""


def document_of(path: Path) -> tuple[Any, str]:
    """The document of a DXF file, and in words that it was repaired, if it was.

    Raises:
        UserError: If it cannot be read, also not by a repair that keeps all that is drawn.
    """
    try:
        return ezdxf.filemanagement.readfile(path), ""
    except (OSError, DXFError, UnicodeDecodeError) as error:
        reason = (
            " ".join(str(error).split()).removeprefix("DXFStructureError: ").replace(str(path), path.name)
        )
    except Exception:  # a damaged file can make ezdxf raise anything
        reason = "it is damaged"
    content = path.read_bytes().removeprefix(b"\xef\xbb\xbf").lstrip()
    is_text = b"SECTION" in content and not content.startswith(b"AutoCAD Binary DXF")
    whole = content.rstrip().endswith(b"EOF")  # else a repair would leave out what is missing
    if is_text and not whole:
        reason = "it ends before EOF, so that it was cut off"
    refused = UserError(f"it cannot be read as DXF: {reason.rstrip('.')}; export it again")
    if not (is_text and whole):
        raise refused
    try:
        document, auditor = recover.read(io.BytesIO(content))
    except Exception:
        raise refused from None
    if auditor.errors or any(fix.code in LOSSES for fix in auditor.fixes):
        raise refused
    return document, ", repaired"


def dxf_scale(document: Any, path: Path, units: str | None) -> Scale:
    """Unit of the coordinates: the given one, that of the header, or mm.

    Raises:
        UserError: If the header has a number that is no unit.
    """
    if units:
        return Scale(UNITS[units], units, "given")
    # ezdxf says metres of a file without a header
    number = document.header.get("$INSUNITS", 0) if b"$INSUNITS" in path.read_bytes() else 0
    if not number:
        return Scale()
    if number not in HEADER_UNITS:
        raise UserError(f'its header has the unit {number} ($INSUNITS), which is none; give units = "mm"')
    name, length = HEADER_UNITS[number]
    return Scale(length, name, "of the header")
