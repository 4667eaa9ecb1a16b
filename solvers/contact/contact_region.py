"""The region where a cylinder touches the front face in equilibrium, with pressure and friction there."""

from dataclasses import dataclass

import numpy as np

from pinnray.solvers.contact.nodal_contact import ContactState, CylinderContact
from pinnray.solvers.problem import Problem, contact_ends
from pinnray.solvers.solution import Contact, ContactPoints

CONTACT_AT_END = (
    "the contact reaches an end of the front face, beyond which none is looked for; "
    "press nearer to its middle or take a smaller stroke or radius"
)


@dataclass(frozen=True)
class ContactRegion:
    """The contact region and its pressure."""

    start: float  # Abscissa of the end nearer to the base before the load, mm
    end: float  # Abscissa of the other end, mm
    parts: int  # Number of separate intervals between them
    width: float  # Deformed length of front face in contact, mm
    penetration: float  # Largest depth of a node within the cylinder, mm
    friction: float  # Sum of friction along the cylinder, counterclockwise around it, N/mm
    sticking: float  # Deformed length of what sticks, mm
    force: tuple[float, float]  # Integral of pressure and friction, N/mm
    at_end: bool  # Whether the region reaches an end of the front face
    points: ContactPoints

    def stats(self) -> dict[str, float | int]:
        """Columns of a solution's `stats`."""
        rubbed = {"contact_friction_N_per_mm": self.friction, "contact_sticking_mm": self.sticking}
        return {
            "contact_start_mm": self.start,
            "contact_end_mm": self.end,
            "contact_parts": self.parts,
            "contact_width_mm": self.width,
            "contact_pressure_MPa": float(self.points.pressure.max()),
            "penetration_mm": self.penetration,
            **(rubbed if self.points.friction.any() else {}),
        }

    @classmethod
    def of(cls, contact: CylinderContact, state: ContactState) -> "ContactRegion | None":
        """The region in equilibrium; None where the cylinder does not touch the finger.

        Its ends lie half way between a point that touches and the next one that does not. In three
        dimensions a point touches if it does so anywhere along z, and slips if it does so wherever it
        touches; pressure and friction are means over the depth.
        """
        normal, around = contact.cylinder(state).axes(contact.moved(state.nodal))
        gap, _ = contact.gaps(state)
        along, levels = np.zeros(len(gap)), len(contact.shares)
        sticks = np.zeros(len(gap), dtype=np.bool_)
        if state.friction is not None:
            along, sticks = contact.frictions(state)[:, 0], contact.slips(state)[2]
        total = state.contact @ normal + along @ around
        nodal, force = state.nodal, state.contact.reshape(levels, -1).sum(axis=0)
        friction, sticks = along.reshape(levels, -1).sum(axis=0), sticks.reshape(levels, -1).any(axis=0)
        touching = np.flatnonzero(force > 0)
        if not len(touching):
            return None
        first, last = int(touching[0]), int(touching[-1])
        x = contact.positions[:, 0]
        between = np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1]), x[-1:]])
        moved = contact.front(nodal)
        halves = 0.5 * np.linalg.norm(np.diff(moved, axis=0), axis=1)
        shares = np.append(halves, 0.0) + np.insert(halves, 0, 0.0)
        lengths = contact.lengths(nodal)[touching]
        points = ContactPoints(
            x=x[touching],
            pressure=force[touching] / lengths,
            friction=friction[touching] / lengths,
            slips=~sticks[touching],
        )
        return cls(
            start=float(between[first]),
            end=float(between[last + 1]),
            parts=int(np.count_nonzero(np.diff(touching) > 1)) + 1,
            width=float(shares[touching].sum()),
            penetration=float(max(0.0, -gap.min())),
            friction=float(friction.sum()),
            sticking=float(shares[touching][~points.slips].sum()),
            force=(float(total[0]), float(total[1])),
            at_end=first == 0 or last == len(x) - 1,
            points=points,
        )


def contact_of(problem: Problem, position: float | None, region: ContactRegion | None) -> Contact | None:
    """The contact of a solution by the abscissa of its force, mm; None without force or contact region."""
    if position is None or (problem.load.kind == "cylinder" and region is None):
        return None
    start, end = contact_ends(problem) if region is None else (region.start, region.end)
    return Contact(position, start, end, None if region is None else region.points)
