"""A finger from a drawing."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from pinnray.geometry.drawing.checks import least_thickness
from pinnray.geometry.drawing.placement import Placement
from pinnray.geometry.finger.design import Design
from pinnray.geometry.finger.finger import Finger
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.geometry.section.loop import Loop
from pinnray.geometry.section.section import Section
from pinnray.runtime.arrays import FloatArray, frozen_array
from pinnray.runtime.content_hash import content_hash
from pinnray.runtime.errors import UserError
from pinnray.runtime.notebook import brief, fact_table

if TYPE_CHECKING:
    from pinnray.runtime.figure import Figure

KIND = "drawing"
"""Value of `kind` in the definition."""

PLAIN = (
    *("name", "contact_abscissa", "contact_width", "depth", "marker_diameter", "marker_height"),
    *("file", "sha256", "note", "unit"),
)
"""Texts and numbers of the definition."""


@dataclass(frozen=True, eq=False)
class DrawnFinger:
    """A finger whose section was drawn; lengths and frame are those of `Finger`.

    Attributes:
        section: With its pieces `base`, `front` and, where there is one, `back`.
        file: Name of the drawing's file.
        sha256: Hash of its content, in hexadecimal.
        note: How it was read, in words.
        placement: From the file's frame, in mm, into the finger's.
        sources: `given`, `drawn` or `proposed` for `clamp`, `contact`, `contact_width`, `markers`,
            `marker_diameter`, `marker_height` and `depth`.
        unit: Length of one unit of the file's coordinates, mm.
        reading: `units`, `plane` and `tolerance` of the description, where they were given.
        mesh: The file's own triangle mesh, in the finger's frame, or None.

    Raises:
        UserError: If the contact is not on the front face or a marker is not in the body.
    """

    name: str
    section: Section
    markers: FloatArray
    contact_abscissa: float
    contact_width: float
    depth: float
    marker_diameter: float
    marker_height: float
    file: str
    sha256: str
    note: str
    placement: Placement
    sources: Mapping[str, str] = field(default_factory=dict)
    unit: float = 1.0
    reading: Mapping[str, str | float] = field(default_factory=dict)
    mesh: TriangleMesh | None = None

    __repr__ = brief

    def __post_init__(self) -> None:
        markers = frozen_array(self.markers, dtype=np.float64, shape=(None, 2), name="markers")
        object.__setattr__(self, "markers", markers)
        object.__setattr__(self, "sources", MappingProxyType(dict(self.sources)))
        object.__setattr__(self, "reading", MappingProxyType(dict(self.reading)))
        for x in self.contact_ends:
            self.section.front_place(x)

    @property
    def marker_layout(self) -> str:
        """Where the markers come from: `given`, `drawn` or `proposed`."""
        return self.sources.get("markers", "given")

    @property
    def marker_radius(self) -> float:
        """Radius of a marker's disc, mm: a marker's displacement is the mean over this disc."""
        return self.marker_diameter / 2

    @property
    def contact_ends(self) -> tuple[float, float]:
        """X of both ends of the contact, mm."""
        half = self.contact_width / 2
        return self.contact_abscissa - half, self.contact_abscissa + half

    @cached_property
    def digest(self) -> str:
        """SHA-256 over the geometry, in hexadecimal; equal for equal fingers, whatever their files."""
        return content_hash(
            {
                "section": self.section.digest,
                "markers": self.markers,
                "numbers": [
                    *(self.contact_abscissa, self.contact_width, self.depth),
                    *(self.marker_diameter, self.marker_height),
                ],
                "mesh": self.mesh.digest if self.mesh else None,
            }
        )

    def at_contact(self, position: float) -> Self:
        """The same finger with the contact's middle at another x, mm.

        The file's own mesh has the contact at its place and is left behind: the section is meshed.

        Raises:
            UserError: If the contact is not on the front face there.
        """
        if position == self.contact_abscissa:
            return self
        sources = {**self.sources, "contact": "given"}
        return replace(self, contact_abscissa=float(position), sources=sources, mesh=None)

    def definition(self) -> dict[str, Any]:
        """Everything that defines the finger, for JSON; of the file's own mesh only the digest."""
        return {
            "kind": KIND,
            **{key: getattr(self, key) for key in PLAIN},
            "section": [
                {"points": loop.points.tolist(), "bulges": loop.bulges.tolist(), "names": list(loop.names)}
                for loop in self.section.loops
            ],
            "markers": self.markers.tolist(),
            "placement": {"matrix": self.placement.matrix.tolist(), "shift": self.placement.shift.tolist()},
            "sources": dict(self.sources),
            "reading": dict(self.reading),
            "mesh": self.mesh.digest if self.mesh else None,
        }

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle the definition and the arrays of the file's own mesh, for the cache and other processes."""
        arrays = self.mesh and self.mesh.arrays()
        return type(self).from_definition, ({**self.definition(), "mesh": arrays},)

    @classmethod
    def from_definition(cls, definition: Mapping[str, Any]) -> Self:
        """The finger of a `definition`, without the file's own mesh, or with it if the arrays are there."""
        values = dict(definition)
        if values.pop("kind", None) != KIND:
            raise UserError("this is no definition of a finger from a drawing")
        loops = [Loop(**{**loop, "names": tuple(loop["names"])}) for loop in values.pop("section")]
        mesh = values.pop("mesh")
        return cls(
            section=Section(loops[0], tuple(loops[1:])),
            placement=Placement(**values.pop("placement")),
            mesh=TriangleMesh.from_arrays(mesh) if isinstance(mesh, Mapping) else None,
            **values,
        )

    def facts(self) -> list[tuple[str, str, str]]:
        """Rows of the report: meaning, an empty symbol, and value with unit."""
        low, high = self.section.bounds
        thickness, where = least_thickness(self.section)
        clamp = sum(loop.lengths[which] for loop, which in self.section.named("base"))
        contact = self.section.front_point(self.contact_abscissa)
        wall = f"{thickness:.4g} mm at ({where[0]:.4g}, {where[1]:.4g})" if np.isfinite(thickness) else "none"
        rows = {
            "Drawing": f"{self.file} ({self.note})",
            "SHA-256 of the drawing": self.sha256,
            "Placement": str(self.placement),
            "Area": f"{self.section.area:.6g} mm2",
            "Extent": f"{high[0] - low[0]:.5g} mm by {high[1] - low[1]:.5g} mm",
            "Cavities": f"{len(self.section.cavities)}",
            "Thinnest wall": wall,
            "Depth": f"{self.depth:.6g} mm{self._source('depth')}",
            "Clamped length": f"{clamp:.5g} mm{self._source('clamp')}",
            "Contact's middle": f"({contact[0]:.5g}, {contact[1] + 0.0:.5g}) mm{self._source('contact')}",
            "Contact's width": f"{self.contact_width:.5g} mm{self._source('contact_width')}",
            "Markers": f"{len(self.markers)}{self._source('markers')}",
            "Marker diameter": f"{self.marker_diameter:.4g} mm{self._source('marker_diameter')}",
        }
        if self.mesh:
            rows["Mesh"] = f"{len(self.mesh.triangles)} triangles of the file, as they are"
        return [(meaning, "", value) for meaning, value in rows.items()]

    def plot(self, width: float | None = None) -> "Figure":
        """The section with clamp, contact and numbered markers in the file's axes, as a matplotlib figure."""
        from pinnray.geometry.finger.picture import plot_finger

        place = self.placement.inverse
        return plot_finger(self, place.section(self.section), place, width)

    def _source(self, key: str) -> str:
        source = self.sources.get(key)
        return f", {source}" if source else ""

    def _repr_html_(self) -> str:
        """The section and the facts, in a notebook."""
        facts = {meaning: value for meaning, _, value in self.facts()}
        return fact_table(f"Finger “{self.name}”", facts, self.plot()._repr_png_())


def description_lines(finger: Finger) -> str:
    """Clamp, contact and markers of a finger as the lines of a description.

    A drawn finger has them in its file's coordinates, another finger in its own frame, mm.
    """
    drawn = finger if isinstance(finger, DrawnFinger) else None
    place = drawn.placement.inverse if drawn else np.asarray
    unit, sources = (drawn.unit, drawn.sources) if drawn else (1.0, {})
    clamp = [place(loop.ends[which]) / unit for loop, which in finger.section.named("base")]
    contact = place(finger.section.front_point(finger.contact_abscissa)) / unit
    where = {
        "clamp": [pair.tolist() for pair in clamp],
        "contact": contact.tolist(),
        "contact_width": finger.contact_width / unit,
        "markers": (place(finger.markers) / unit).tolist(),
        "marker_diameter": finger.marker_diameter / unit,
        "marker_height": finger.marker_height / unit,
        "depth": finger.depth / unit,
    }
    file = drawn.file if drawn else finger.name
    lines = [f"# {file}: where it is clamped, touched and marked, in the file's coordinates."]
    lines += [f"# It was read as {' '.join(drawn.note.split())}."] if drawn else []
    lines += [f"{key} = {json.dumps(value)}" for key, value in (drawn.reading if drawn else {}).items()]
    for key, value in where.items():
        source = sources.get(key)
        lines.append(f"{key} = {json.dumps(value)}" + (f"  # {source}" if source else ""))
    return "\n".join([*lines, ""])


def finger_lines(finger: Finger) -> str:
    """The lines of the file that a finger is read from: a design's parameters, or a drawing's description."""
    return finger.lines() if isinstance(finger, Design) else description_lines(finger)


def finger_from(definition: Mapping[str, Any]) -> Finger:
    """The finger that `Finger.definition` describes.

    Raises:
        UserError: If the parameters break a rule.
    """
    if "section" in definition:
        return DrawnFinger.from_definition(definition)
    return Design(**definition)
