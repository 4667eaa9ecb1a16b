"""The MJCF file of a finger for MuJoCo: a chain of hinges."""

from collections.abc import Sequence
from textwrap import fill
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import ArrayLike

from pinnray.robots.chain import MM, Chain
from pinnray.robots.springs import Springs
from pinnray.runtime.arrays import FloatArray

STEP = 1e-3
"""Time step, s."""
HARD = {"solref": "0.002 1", "solimp": "0.99 0.999 0.0001"}
"""Contact that gives way by hundredths of a millimetre, with a time constant of two steps."""
HARDER = {"solref": "0.002 1", "solimp": "0.999 0.9999 0.0001"}
"""Likewise, of the indenter that presses the chain to score it."""
BODY_COLOUR = "0.9 0.6 0.3 1"


def chain_mjcf(
    name: str, chain: Chain, springs: Springs, wall: float, depth: float, loss_factor: float
) -> str:
    """The MJCF file of a chain.

    Args:
        name: Of the model.
        chain: Its links; the file has bodies `link1` and so on, link 0 being part of `finger`.
        springs: Its fixed tendons.
        wall: Thickness of the links' boxes, mm: the front wall's.
        depth: Of the finger, mm.
        loss_factor: Of every vibration: stated, not fitted, for lack of a measurement.
    """
    root = _model(name)
    parent = ET.SubElement(ET.SubElement(root, "worldbody"), "body", name="finger")
    for link, step in enumerate(np.diff(chain.points, axis=0)):
        if link:
            start = chain.points[link]
            at = start if link == 1 else start - chain.points[link - 1]
            parent = ET.SubElement(parent, "body", name=f"link{link}", pos=_text([*at, 0]))
            if link == 1:
                ET.SubElement(parent, "joint", name="slide", type="slide", axis=_text([*chain.axis, 0]))
            ET.SubElement(parent, "joint", name=f"hinge{link}", type="hinge", axis="0 0 1")
        else:
            start = np.zeros(2)
        mass, turning = chain.masses[link], chain.inertias[link]
        across = mass * (MM * depth) ** 2 / 12
        ET.SubElement(
            parent,
            "inertial",
            pos=_text([*chain.centres[link] - start, 0]),
            mass=_text(mass),
            # How a slice's inertia in the plane is shared between x and y matters to no hinge.
            diaginertia=_text([turning / 2 + across, turning / 2 + across, turning]),
        )
        length, half = float(np.linalg.norm(step)), MM * wall / 2
        inward = np.array([step[1], -step[0]]) / length
        ET.SubElement(
            parent,
            "geom",
            HARD,
            name=f"front{link}",
            type="box",
            pos=_text([*chain.points[link] - start + step / 2 + half * inward, 0]),
            size=_text([length / 2, half, MM * depth / 2]),
            euler=_text([0, 0, np.arctan2(step[1], step[0])]),
            rgba=BODY_COLOUR,
        )
    # Neighbours overlap where they turn, and MuJoCo excludes no pair with a body that is fixed.
    ET.SubElement(ET.SubElement(root, "contact"), "exclude", body1="finger", body2="link1")
    tendons = ET.SubElement(root, "tendon")
    dampings = loss_factor * springs.stiffnesses / springs.frequencies
    joints = ["slide", *(f"hinge{link}" for link in range(1, chain.hinges + 1))]
    for row, stiffness, resistance in zip(springs.rows, springs.stiffnesses, dampings, strict=True):
        tendon = ET.SubElement(
            tendons, "fixed", springlength="0", stiffness=_text(stiffness), damping=_text(resistance)
        )
        for joint, coefficient in zip(joints, row, strict=True):
            ET.SubElement(tendon, "joint", joint=joint, coef=_text(coefficient))
    return _written(root)


def with_header(text: str, lines: Sequence[str]) -> str:
    """A model with a comment before it."""
    said = "\n".join(fill(line, 110) for line in lines).replace("--", "- -")  # two hyphens would end it
    return f"<!--\n{said}\n-->\n{text}"


def _model(name: str) -> ET.Element:
    root = ET.Element("mujoco", model=name)
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    ET.SubElement(root, "option", timestep=_text(STEP), integrator="implicitfast", gravity="0 0 0")
    return root


def _written(root: ET.Element) -> str:
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def _text(values: ArrayLike) -> str:
    found: FloatArray = np.asarray(values)
    return " ".join(f"{value:.9g}" for value in found.ravel())
