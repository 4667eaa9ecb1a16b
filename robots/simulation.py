"""A model for MuJoCo pressed by the cylinder of a load, until it is at rest.

Needs the extra `robots`: MuJoCo 4, whose earlier versions have other elastic constants of flexible bodies.
"""

import importlib.util
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

import numpy as np

from pinnray.robots.chain import MM, Chain
from pinnray.robots.mjcf import HARDER
from pinnray.robots.presses import Press
from pinnray.robots.solid_mesh import SolidMesh
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError

RAMP, HOLD = 0.1, 0.25
"""Times in which the cylinder moves and is held, s."""
MEAN = 0.2
"""Last part of the hold over which forces and places are averaged."""
STEADY = 0.02
"""Largest standard deviation of the force there over its mean in a model at rest."""

FAULTS = ("CONTACTFULL", "CNSTRFULL", "BADQPOS", "BADQVEL", "BADQACC")
"""MuJoCo's warnings after which a state is not to be believed; after the last three it starts anew."""


@dataclass(frozen=True, eq=False)
class Model:
    """A model for MuJoCo.

    Attributes:
        name: Of its file.
        text: MJCF.
        front: From a model and its state, the places of the front's points, shape (m, 2), m.
    """

    name: str
    text: str
    front: Callable[[Any, Any], FloatArray]


@dataclass(frozen=True, eq=False)
class Rest:
    """A pressed model at rest."""

    moved: FloatArray  #: Displacements of the front's points, shape (m, 2), mm
    force: FloatArray  #: On the model, shape (2,), N
    steady: bool  #: Whether the force has settled, and MuJoCo has not given up
    seconds: float  #: Computing time of one second of the model's time, s


def check_mujoco() -> None:
    """Raise a `UserError` unless MuJoCo 4 is installed."""
    if importlib.util.find_spec("mujoco") is None:
        raise UserError("MuJoCo is not installed; pip install 'pinn-ray[robots]'")
    import mujoco

    if int(mujoco.__version__.split(".")[0]) < 4:
        raise UserError(
            f"this is MuJoCo {mujoco.__version__}, whose flexible bodies have other elastic constants; "
            "pip install 'pinn-ray[robots]'"
        )


def chain_front(chain: Chain, rest: FloatArray) -> Callable[[Any, Any], FloatArray]:
    """The front's points, at rest in shape (m, 2), m, as the simulator's links carry them."""
    links = chain.link_of(rest)

    def places(model: Any, data: Any) -> FloatArray:
        found = rest.copy()
        for link in range(1, chain.hinges + 1):
            body, own = data.body(f"link{link}"), links == link
            turning = body.xmat.reshape(3, 3)[:2, :2]
            found[own] = body.xpos[:2] + (rest[own] - chain.points[link]) @ turning.T
        return found

    return places


def flex_front(body: SolidMesh, rest: FloatArray) -> Callable[[Any, Any], FloatArray]:
    """The front's points, at rest in shape (m, 2), m, between the body's nodes, meant over the depth."""
    flat = np.unique(body.section.boundary("front"))
    flat = flat[body.section.points[flat, 0].argsort()]
    nodes = flat + len(body.section.points) * np.arange(body.levels)[:, None]
    drawn = MM * body.section.points[flat]

    def places(model: Any, data: Any) -> FloatArray:
        moved = data.flexvert_xpos.reshape(-1, 3)[nodes, :2].mean(axis=0) - drawn
        between = [np.interp(rest[:, 0], drawn[:, 0], each) for each in moved.T]
        return np.asarray(rest + np.column_stack(between))

    return places


def pressed_in_mujoco(model: Model, load: Press, radius: float, depth: float, rest: FloatArray) -> Rest:
    """Press a model as a load says.

    Args:
        model: The model.
        load: Centre and travel of the cylinder.
        radius: Of the cylinder, mm.
        depth: Of the finger, mm.
        rest: The front's points at rest, shape (m, 2), m.
    """
    import mujoco

    spec = mujoco.MjSpec.from_string(model.text)
    centre = MM * load.centre
    body = spec.worldbody.add_body(name="indenter", mocap=True, pos=[*centre, 0])
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,  # a cylinder, as it is longer than the finger is deep
        size=[MM * radius, MM * depth, 0],
        priority=1,
        condim=1,
        solref=[float(each) for each in HARDER["solref"].split()],
        solimp=[*(float(each) for each in HARDER["solimp"].split()), 0.5, 2],
    )
    with ExitStack() as stack:  # MuJoCo writes no MUJOCO_LOG.TXT: `FAULTS` are counted
        stack.callback(mujoco.set_mju_user_warning, mujoco.get_mju_user_warning())
        mujoco.set_mju_user_warning(lambda text: None)
        compiled = spec.compile()
        data = mujoco.MjData(compiled)
        step = compiled.opt.timestep
        forces, places = [], []
        started = time.process_time()
        for count in range(round((RAMP + HOLD) / step)):
            share = min(1.0, count * step / RAMP)
            smooth = share * share * (3 - 2 * share)
            data.mocap_pos[0, 1] = centre[1] - smooth * MM * load.travel
            mujoco.mj_step(compiled, data)
            if count * step > RAMP + (1 - MEAN) * HOLD:
                forces.append(_force(compiled, data))
                places.append(model.front(compiled, data))
        seconds = (time.process_time() - started) / (RAMP + HOLD)
    faults = sum(data.warning[getattr(mujoco.mjtWarning, f"mjWARN_{name}")].number for name in FAULTS)
    force = np.mean(forces, axis=0)
    spread = float(np.linalg.norm(np.std(forces, axis=0)))
    return Rest(
        moved=(np.mean(places, axis=0) - rest) / MM,
        force=force,
        steady=bool(not faults and spread <= STEADY * np.linalg.norm(force)),
        seconds=seconds,
    )


def _force(model: Any, data: Any) -> FloatArray:
    """Force of the indenter, the last geom, on the finger, shape (2,), N."""
    import mujoco

    total, wrench = np.zeros(3), np.zeros(6)
    for number in range(data.ncon):
        contact = data.contact[number]
        if model.ngeom - 1 not in contact.geom:
            continue
        mujoco.mj_contactForce(model, data, number, wrench)
        pushed = contact.frame.reshape(3, 3).T @ wrench[:3]  # by the first one on the second
        total += pushed if contact.geom[0] == model.ngeom - 1 else -pushed
    return total[:2]
