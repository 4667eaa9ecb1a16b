"""Opens a STEP file: its solids where the assembly places them, with the names of their parts."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import cadquery as cq
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.gp import gp_Trsf
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.Interface import Interface_Static
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.STEPConstruct import STEPConstruct_ExternRefs
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label, TDF_LabelSequence
from OCP.TDocStd import TDocStd_Document
from OCP.XCAFDoc import XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

from pinnray.runtime.errors import UserError

MARKER = re.compile(r"markers?([-_ .:]?\d+)*(\s*[(<]\d+[)>])?$", re.IGNORECASE)
"""Names of the parts that are markers: also `marker-1:1` of Fusion, `marker-1<2>` of SolidWorks."""


class Part(NamedTuple):
    """A solid in its place, with its own name and those of the assemblies around it, the nearest first."""

    solid: cq.Solid
    names: tuple[str, ...]

    @property
    def is_marker(self) -> bool:
        """Whether it, or an assembly that it is in, is called a marker."""
        return any(MARKER.match(name) for name in self.names)

    def __str__(self) -> str:
        name = next((name for name in self.names if name.strip() and not name.isdigit()), "without name")
        return f"{name} ({self.solid.Volume():.4g} mm3)"


def parts_of(path: Path) -> list[Part]:
    """The solids of a STEP file, mm.

    Raises:
        UserError: If it cannot be read, holds no solid, or refers to other files, of any folder, which
            OpenCASCADE would read, too.
    """
    reader = STEPCAFControl_Reader()
    reader.SetNameMode(True)
    Interface_Static.SetIVal_s("read.stepcaf.subshapes.name", 1)
    Interface_Static.SetCVal_s("xstep.cascade.unit", "MM")
    if reader.ReadFile(str(path)) != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise UserError("it cannot be read as STEP: it is damaged or cut off; export it again")
    others = STEPConstruct_ExternRefs(reader.Reader().WS())
    others.LoadExternRefs()
    if others.NbExternRefs():
        raise UserError(
            f"it refers to another file, {others.FileName(1)!r}, which is not read; export the "
            "whole as one file"
        )
    document = TDocStd_Document(TCollection_ExtendedString("XmXCAF"))
    if not reader.Transfer(document):
        raise UserError("it cannot be read as STEP: it holds no shape; export the body as a solid")
    roots = TDF_LabelSequence()
    XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).GetFreeShapes(roots)
    parts = [part for root in roots for part in _placed(root, gp_Trsf(), ())]
    if not parts:
        raise UserError("it holds no solid; export the body as a solid")
    return parts


def _placed(label: TDF_Label, around: gp_Trsf, within: tuple[str, ...]) -> Iterator[Part]:
    """The solids of a label of the document, moved as it and the assemblies around it say."""
    part = TDF_Label()
    if not XCAFDoc_ShapeTool.GetReferredShape_s(label, part):
        part = label
    place = around.Multiplied(XCAFDoc_ShapeTool.GetLocation_s(label).Transformation())
    names = (_name(label), _name(part))
    if XCAFDoc_ShapeTool.IsAssembly_s(part):
        components = TDF_LabelSequence()
        XCAFDoc_ShapeTool.GetComponents_s(part, components)
        is_root = label.IsEqual(part)  # its name is the file's
        for component in components:
            yield from _placed(component, place, () if is_root else (*names, *within))
        return
    shape, inner = XCAFDoc_ShapeTool.GetShape_s(part), TDF_LabelSequence()
    if shape.IsNull():
        return
    XCAFDoc_ShapeTool.GetSubShapes_s(part, inner)
    own = [(XCAFDoc_ShapeTool.GetShape_s(each), _name(each)) for each in inner]
    for solid in cq.Shape.cast(shape).Solids():
        called = tuple(name for each, name in own if each.IsSame(solid.wrapped))
        # a copy, which may be mirrored or scaled
        copy = BRepBuilderAPI_Transform(solid.wrapped, place, True).Shape()
        for moved in cq.Shape.cast(copy).Solids():
            yield Part(moved, (*called, *names, *within))


def _name(label: TDF_Label) -> str:
    """Name of a label; asking for one that it lacks would end the process (CadQuery/OCP, issue 225)."""
    name = TDataStd_Name()
    if not label.IsAttribute(TDataStd_Name.GetID_s()):
        return ""
    label.FindAttribute(TDataStd_Name.GetID_s(), name)
    return str(name.Get().ToExtString())
