"""A finger as a plane frame of beams: walls and ribs by Timoshenko's theory, in a millisecond.

It misses the shape of joints and solid ends, but follows the parameters as the body does: what is left for an
emulator to learn is smaller and smoother than the quantities. Young's modulus and depth are one.

Source: J. S. Przemieniecki, Theory of Matrix Structural Analysis, McGraw-Hill 1968, section 5.6.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pinnray.geometry.finger.parameters import Parameters
from pinnray.geometry.finger.section import back_line, base_line, front_line, rib_axes, tip_line
from pinnray.runtime.arrays import FloatArray, IntArray
from pinnray.solvers.problem import Material

SHEAR_SHARE = 5 / 6
"""Shear correction factor of a rectangle."""

SHORTEST = 0.1
"""Smallest length of a beam, mm."""

TIP_THICKNESS = 0.5
"""Thickness of the beams of the solid tip over its length."""


JOINT = 0.5
"""Share of half the crossing wall or rib by which a beam is rigid at a joint: the size of the joint."""

ELASTIC = 0.2
"""Least share of a beam that is not rigid."""


@dataclass(frozen=True, eq=False)
class BeamFrame:
    """Beams of n fingers with the same number of ribs.

    The nodes are the ends of the rib axes on the front wall, the contact, the front wall's two ends; the rib
    axes' ends on the back wall and its two ends; the apex.

    Attributes:
        points: Nodes, shape (n, k, 2), mm.
        beams: Numbers of the nodes of every beam, shape (n, b, 2).
        thickness: Of the beams, shape (n, b), mm.
        ribs: Number of ribs.
    """

    points: FloatArray
    beams: IntArray
    thickness: FloatArray
    ribs: int

    @classmethod
    def of(cls, fingers: Sequence[Parameters]) -> "BeamFrame":
        """The frames of fingers with the same number of ribs."""
        ribs = fingers[0].rib_count
        points = np.stack([_nodes(each) for each in fingers])
        front, back = np.arange(ribs + 3), np.arange(ribs + 3, 2 * ribs + 5)
        front_order = points[:, front, 0].argsort(axis=1)
        back_order = back[points[:, back, 0].argsort(axis=1)]
        tips = np.array([[ribs + 2, 2 * ribs + 4], [ribs + 2, 2 * ribs + 5], [2 * ribs + 4, 2 * ribs + 5]])
        across = np.stack([front[:ribs], back[:ribs]], axis=1)
        beams = np.concatenate(
            [
                np.stack([front_order[:, :-1], front_order[:, 1:]], axis=2),
                np.stack([back_order[:, :-1], back_order[:, 1:]], axis=2),
                np.broadcast_to(np.concatenate([across, tips]), (len(fingers), ribs + 3, 2)),
            ],
            axis=1,
        )
        counts = (ribs + 2, ribs + 1, ribs, 3)
        names = ("front_thickness", "back_thickness", "rib_thickness", "tip_length")
        thickness = np.array([[getattr(each, name) for name in names] for each in fingers])
        thickness[:, 3] *= TIP_THICKNESS
        return cls(points, beams, np.repeat(thickness, counts, axis=1), ribs)

    def rigid(self, length: FloatArray) -> FloatArray:
        """Rigid lengths at both ends of the beams, shape (n, b, 2), mm."""
        ribs, walls = self.ribs, 2 * self.ribs + 3
        found = np.zeros((*length.shape, 2))
        joints = np.zeros(self.points.shape[1])
        joints[:ribs] = joints[ribs + 3 : 2 * ribs + 3] = 1.0
        rib = self.thickness[:, walls, None, None]
        found[:, :walls] = 0.5 * JOINT * rib * joints[self.beams[:, :walls]]
        found[:, walls : walls + ribs] = 0.5 * JOINT * self.thickness[:, None, [0, ribs + 2]]
        share = (1 - ELASTIC) * length / np.maximum(found.sum(axis=2), 1e-12)
        return np.asarray(found * np.minimum(share, 1.0)[..., None])

    def response(self, material: Material, travel: tuple[float | None, float | None]) -> "BeamResponse":
        """What the frames do if their contact moves by `travel`, mm; None is free of force."""
        start, end = (np.take_along_axis(self.points, self.beams[:, :, side, None], 1) for side in (0, 1))
        length = np.maximum(np.linalg.norm(end - start, axis=2), SHORTEST)
        rigid = self.rigid(length)
        elastic = length - rigid.sum(axis=2)
        modes = _deformations((end - start) / length[..., None], elastic, rigid)
        stiffness = _stiffness(elastic, self.thickness, material)
        degrees = (3 * self.beams[..., None] + np.arange(3)).reshape(*length.shape, 6)
        count, size = len(self.points), 3 * self.points.shape[1]
        whole = np.zeros((count, size, size))
        finger = np.arange(count)[:, None, None]
        own = modes.swapaxes(2, 3) @ stiffness @ modes
        np.add.at(whole, (finger[..., None], degrees[..., :, None], degrees[..., None, :]), own)
        clamped = [3 * node + part for node in (self.ribs, 2 * self.ribs + 3) for part in range(3)]
        free = np.setdiff1d(np.arange(size), clamped)
        contact, apex = 3 * (self.ribs + 1), 3 * (2 * self.ribs + 5)
        unit = np.zeros((count, size, 2))
        unit[:, contact, 0] = unit[:, contact + 1, 1] = 1.0
        moved = np.zeros_like(unit)
        moved[:, free] = np.linalg.solve(whole[:, free[:, None], free], unit[:, free])
        compliance = moved[:, contact : contact + 2]
        axes = [axis for axis, value in enumerate(travel) if value is not None]
        values = np.array([value for value in travel if value is not None])
        force = np.zeros((count, 2, 1))
        given = np.broadcast_to(values[:, None], (count, len(axes), 1))
        force[:, axes] = np.linalg.solve(compliance[:, axes][:, :, axes], given)
        state = (moved @ force)[..., 0]
        forces = stiffness @ modes @ state[finger, degrees][..., None]
        moment = np.abs(modes.swapaxes(2, 3) @ forces)[..., [2, 5], 0].max(axis=2)
        stress = np.abs(forces[..., 0, 0]) / self.thickness + 6 * moment / self.thickness**2
        parts = np.cumsum([0, self.ribs + 2, self.ribs + 1, self.ribs])
        return BeamResponse(
            force=force[:, axes, 0] @ (values / np.linalg.norm(values)),
            compliance=np.diagonal(compliance, axis1=1, axis2=2),
            contact=state[:, contact : contact + 2],
            tip=state[:, apex : apex + 2],
            stress=np.stack(
                [stress[:, first:last].max(axis=1, initial=0.0) for first, last in pairwise(parts)], axis=1
            ),
        )


@dataclass(frozen=True, eq=False)
class BeamResponse:
    """What n frames of Young's modulus and depth one do.

    Attributes:
        force: Of the indenter along its stroke, shape (n,), mm^2.
        compliance: Displacement of the contact per force, along and across, shape (n, 2).
        contact: Displacement of the contact, shape (n, 2), mm.
        tip: Displacement of the apex, shape (n, 2), mm.
        stress: Largest at the ends of the beams of front wall, back wall and ribs, shape (n, 3).
    """

    force: FloatArray
    compliance: FloatArray
    contact: FloatArray
    tip: FloatArray
    stress: FloatArray


def _nodes(p: Parameters) -> FloatArray:
    """The nodes of a finger's frame, shape (k, 2), mm."""
    axes = rib_axes(p)
    front, back = front_line(p.front_thickness / 2), back_line(p, p.back_thickness / 2)
    ends = [base_line(p, p.base_thickness / 2), tip_line(p)]
    contact = np.array([p.contact_abscissa, -p.front_thickness / 2])
    return np.array(
        [
            *(*axes[:, 0], ends[0].meets(front), contact, ends[1].meets(front)),
            *(*axes[:, 1], ends[0].meets(back), ends[1].meets(back)),
            np.array([p.height, 0.0]),
        ]
    )


def _deformations(along: FloatArray, elastic: FloatArray, rigid: FloatArray) -> FloatArray:
    """What motions of the two nodes (u, v, turn each) do to beams, shape (..., 3, 6).

    Rows are the stretch, mm, and how far either end of the elastic part turns from the line between its ends.

    Args:
        along: Unit vectors, shape (..., 2).
        elastic: Lengths of the elastic parts, shape (...), mm.
        rigid: Lengths of the rigid parts at both ends, shape (..., 2), mm.
    """
    across = np.stack([-along[..., 1], along[..., 0]], axis=-1)[..., None, :] / elastic[..., None, None]
    found = np.zeros((*elastic.shape, 3, 6))
    found[..., 0, :2], found[..., 0, 3:5] = -along, along
    found[..., 1:, :2], found[..., 1:, 3:5] = across, -across
    found[..., 1:, [2, 5]] = np.eye(2) + (rigid / elastic[..., None])[..., None, :]
    return found


def _stiffness(length: FloatArray, thickness: FloatArray, material: Material) -> FloatArray:
    """Stiffness of elastic beams against their deformations, shape (..., 3, 3)."""
    modulus = 1 / (1 - material.poisson**2) if material.plane == "strain" else 1.0
    shear = SHEAR_SHARE * thickness / (2 * (1 + material.poisson))
    bending = modulus * thickness**3 / 12
    phi = 12 * bending / (shear * length**2)
    part = bending / ((1 + phi) * length)
    found = np.zeros((*length.shape, 3, 3))
    found[..., 0, 0] = modulus * thickness / length
    found[..., 1, 1] = found[..., 2, 2] = (4 + phi) * part
    found[..., 1, 2] = found[..., 2, 1] = (2 - phi) * part
    return found
