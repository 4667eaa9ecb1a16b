"""MJCF files of a finger for MuJoCo: a chain of hinges, two of it as a gripper, and a flexible body."""

from collections.abc import Sequence
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


def chain_mjcf(name: str, chain: Chain, springs: Springs, wall: float, depth: float, loss: float) -> str:
    """The MJCF file of a chain.

    Args:
        name: Of the model.
        chain: Its links; the file has bodies `link1` and so on, link 0 being part of `finger`.
        springs: Its fixed tendons.
        wall: Thickness of the links' boxes, mm: the front wall's.
        depth: Of the finger, mm.
        loss: Loss factor of every vibration.
    """
    root, starts = _model(name, "implicitfast"), chain.points.copy()
    starts[0] = 0.0  # link 0 is part of the finger
    parent = _add(_add(root, "worldbody"), "body", name="finger")
    for link, (start, step) in enumerate(zip(starts, np.diff(chain.points, axis=0), strict=False)):
        if link:
            parent = _add(parent, "body", name=f"link{link}", pos=[*start - starts[link - 1], 0])
            if link == 1:
                _add(parent, "joint", name="slide", type="slide", axis=[*chain.axis, 0])
            _add(parent, "joint", name=f"hinge{link}", type="hinge", axis="0 0 1")
        mass, turning = chain.masses[link], chain.inertias[link]
        # How a slice's inertia in the plane is shared between x and y matters to no hinge.
        beside = turning / 2 + mass * (MM * depth) ** 2 / 12
        centre = [*chain.centres[link] - start, 0]
        _add(parent, "inertial", pos=centre, mass=mass, diaginertia=[beside, beside, turning])
        length, half = float(np.linalg.norm(step)), MM * wall / 2
        inward = np.array([step[1], -step[0]]) / length
        _add(
            parent,
            "geom",
            **HARD,
            name=f"front{link}",
            type="box",
            pos=[*chain.points[link] - start + step / 2 + half * inward, 0],
            size=[length / 2, half, MM * depth / 2],
            euler=[0, 0, np.arctan2(step[1], step[0])],
            rgba=BODY_COLOUR,
        )
    # Neighbours overlap where they turn, and MuJoCo excludes no pair with a body that is fixed.
    _add(_add(root, "contact"), "exclude", body1="finger", body2="link1")
    tendons = _add(root, "tendon")
    dampings = loss * springs.stiffnesses / springs.frequencies
    joints = ["slide", *(f"hinge{link}" for link in range(1, chain.hinges + 1))]
    for row, stiffness, resistance in zip(springs.rows, springs.stiffnesses, dampings, strict=True):
        tendon = _add(tendons, "fixed", springlength=0, stiffness=stiffness, damping=resistance)
        for joint, coefficient in zip(joints, row, strict=True):
            _add(tendon, "joint", joint=joint, coef=coefficient)
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
    _add(_add(root, "asset"), "model", name="finger", file=chain)
    world, drives = _add(root, "worldbody"), _add(root, "actuator")
    for side, sign, turn in (("left", -1, 0.0), ("right", 1, np.pi)):
        away = sign * (radius + place[1] + CLEARANCE)
        body = _add(world, "body", name=side, pos=[0, MM * away, 0], euler=[turn, 0, 0])
        _add(body, "joint", name=side, type="slide", axis="0 1 0", armature=CARRIAGE)
        _add(body, "attach", model="finger", body="finger", prefix=f"{side}-")
        reach = [0, MM * (stroke + CLEARANCE)]
        _add(drives, "position", **DRIVE, name=side, joint=side, ctrlrange=reach)
    body = _add(world, "body", name="object", pos=[MM * place[0], 0, 0])
    _add(body, "freejoint")
    size = [MM * radius, MM * depth / 2]
    _add(body, "geom", **HARD, name="object", type="cylinder", size=size, density=1000)
    return _written(root)


def flex_mjcf(name: str, body: SolidMesh, material: Material, density: float, damping: float) -> str:
    """The MJCF file of a flexible body, of Saint Venant and Kirchhoff's law on linear tetrahedra.

    Args:
        name: Of the model.
        body: Its tetrahedra; nodes on the base are pinned.
        material: Its elastic constants.
        density: Of the material, kg/m^3.
        damping: Time constant of its damping: a loss factor over an angular frequency, s.
    """
    root = _model(name, "discrete")
    _add(root, "size", memory="256M")
    finger, mass = _add(_add(root, "worldbody"), "body", name="finger"), density * body.volume
    kind = {"name": "flex", "type": "direct", "dim": "3", "radius": "0"}
    cells = {"point": body.points, "element": body.tetrahedra}
    flex = _add(finger, "flexcomp", **kind, mass=mass, **cells, rgba=BODY_COLOUR)
    _add(flex, "contact", **HARDER, selfcollide="none")
    _add(flex, "elasticity", young=1e6 * material.young, poisson=material.poisson, damping=damping)
    _add(flex, "pin", id=body.nodes_on("base"))
    return _written(root)


def with_header(text: str, lines: Sequence[str]) -> str:
    """A model with a comment before it."""
    said = "\n".join(fill(line, 110) for line in lines).replace("--", "- -")  # two hyphens would end it
    return f"<!--\n{said}\n-->\n{text}"


def _model(name: str, integrator: str, step: float = STEP) -> ET.Element:
    root = ET.Element("mujoco", model=name)
    _add(root, "compiler", angle="radian", autolimits="true")
    _add(root, "option", timestep=step, integrator=integrator, gravity="0 0 0")
    return root


def _written(root: ET.Element) -> str:
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def _add(parent: ET.Element, tag: str, **values: ArrayLike) -> ET.Element:
    """A new element in another one, with words, numbers and arrays as its attributes."""
    texts = {
        name: each if isinstance(each, str) else " ".join(f"{value:.9g}" for value in np.ravel(each))
        for name, each in values.items()
    }
    return ET.SubElement(parent, tag, texts)
