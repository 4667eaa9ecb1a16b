"""MJCF files of a finger for MuJoCo: a chain of hinges, two of it as a gripper, and a flexible body."""

from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import fill
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import ArrayLike

from pinnray.robots.chain import MM, Chain
from pinnray.robots.solid_mesh import SolidMesh
from pinnray.robots.springs import Springs
from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.material import Material

STEP = 1e-3
"""Time step, s."""
HARD = {"solref": "0.002 1", "solimp": "0.99 0.999 0.0001"}
"""Contact that gives way by hundredths of a millimetre, with a time constant of two steps."""
HARDER = {"solref": "0.002 1", "solimp": "0.999 0.9999 0.0001"}
"""Likewise, for the light nodes of the flexible body."""
CLEARANCE = 0.5
"""Of an open gripper from its object, mm."""
DRIVE = {"kp": "100000", "dampratio": "1"}
"""Position control of a finger's carriage, N/m."""
CARRIAGE = "0.2"
"""Mass of a carriage, kg."""
BODY_COLOUR = "0.9 0.6 0.3 1"


@dataclass(frozen=True)
class Damping:
    """Damping of a model: stated, not fitted, for lack of a measurement."""

    loss_factor: float  #: Of every vibration of the chain, and of the body's first one
    frequency: float  #: Angular frequency of the first vibration, rad/s


def chain_mjcf(name: str, chain: Chain, springs: Springs, wall: float, depth: float, damping: Damping) -> str:
    """The MJCF file of a chain.

    Args:
        name: Of the model.
        chain: Its links; the file has bodies `link1` and so on, link 0 being part of `finger`.
        springs: Its fixed tendons.
        wall: Thickness of the links' boxes, mm: the front wall's.
        depth: Of the finger, mm.
        damping: Its loss factor.
    """
    root = _model(name, "implicitfast")
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
    dampings = damping.loss_factor * springs.stiffnesses / springs.frequencies
    joints = ["slide", *(f"hinge{link}" for link in range(1, chain.hinges + 1))]
    for row, stiffness, resistance in zip(springs.rows, springs.stiffnesses, dampings, strict=True):
        tendon = ET.SubElement(
            tendons, "fixed", springlength="0", stiffness=_text(stiffness), damping=_text(resistance)
        )
        for joint, coefficient in zip(joints, row, strict=True):
            ET.SubElement(tendon, "joint", joint=joint, coef=_text(coefficient))
    return _written(root)


def gripper_mjcf(name: str, chain: str, place: FloatArray, radius: float, depth: float, stroke: float) -> str:
    """The MJCF file of two fingers on either side of a cylinder, which is free.

    Args:
        name: Of the model.
        chain: Name of the finger's file beside it.
        place: Abscissa of the cylinder's axis, and the highest ordinate of the front face, shape (2,), mm.
        radius: Of the cylinder, mm.
        depth: Of the finger, mm.
        stroke: How far each carriage moves beyond the first touch, mm.
    """
    root = _model(name, "implicitfast", STEP / 2)  # a held object shakes loose in whole ones
    ET.SubElement(ET.SubElement(root, "asset"), "model", name="finger", file=chain)
    world, drives = ET.SubElement(root, "worldbody"), ET.SubElement(root, "actuator")
    for side, sign, turn in (("left", -1, 0.0), ("right", 1, np.pi)):
        away = sign * (radius + place[1] + CLEARANCE)
        body = ET.SubElement(
            world, "body", name=side, pos=_text([0, MM * away, 0]), euler=_text([turn, 0, 0])
        )
        ET.SubElement(body, "joint", name=side, type="slide", axis="0 1 0", armature=CARRIAGE)
        ET.SubElement(body, "attach", model="finger", body="finger", prefix=f"{side}-")
        reach = _text([0, MM * (stroke + CLEARANCE)])
        ET.SubElement(drives, "position", DRIVE, name=side, joint=side, ctrlrange=reach)
    body = ET.SubElement(world, "body", name="object", pos=_text([MM * place[0], 0, 0]))
    ET.SubElement(body, "freejoint")
    size = _text([MM * radius, MM * depth / 2])
    ET.SubElement(body, "geom", HARD, name="object", type="cylinder", size=size, density="1000")
    return _written(root)


def flex_mjcf(name: str, body: SolidMesh, material: Material, density: float, damping: Damping) -> str:
    """The MJCF file of a flexible body, of Saint Venant and Kirchhoff's law on linear tetrahedra.

    Args:
        name: Of the model.
        body: Its tetrahedra; nodes on the base are pinned.
        material: Its elastic constants.
        density: Of the material, kg/m^3.
        damping: Its loss factor at the first vibration.
    """
    root = _model(name, "discrete")
    ET.SubElement(root, "size", memory="256M")
    finger = ET.SubElement(ET.SubElement(root, "worldbody"), "body", name="finger")
    flex = ET.SubElement(
        finger,
        "flexcomp",
        name="flex",
        type="direct",
        dim="3",
        radius="0",
        mass=_text(density * body.volume),
        point=_text(body.points),
        element=_text(body.tetrahedra),
        rgba=BODY_COLOUR,
    )
    ET.SubElement(flex, "contact", HARDER, selfcollide="none")
    ET.SubElement(
        flex,
        "elasticity",
        young=_text(1e6 * material.young),
        poisson=_text(material.poisson),
        damping=_text(damping.loss_factor / damping.frequency),
    )
    ET.SubElement(flex, "pin", id=_text(body.nodes_on("base")))
    return _written(root)


def with_header(text: str, lines: Sequence[str]) -> str:
    """A model with a comment before it."""
    said = "\n".join(fill(line, 110) for line in lines).replace("--", "- -")  # two hyphens would end it
    return f"<!--\n{said}\n-->\n{text}"


def _model(name: str, integrator: str, step: float = STEP) -> ET.Element:
    root = ET.Element("mujoco", model=name)
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    ET.SubElement(root, "option", timestep=_text(step), integrator=integrator, gravity="0 0 0")
    return root


def _written(root: ET.Element) -> str:
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def _text(values: ArrayLike) -> str:
    found: FloatArray = np.asarray(values)
    return " ".join(f"{value:.9g}" for value in found.ravel())
