"""A part as a hand finds it: pushed, left, and swung on through ``asset2sim.load``."""

import math
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from asset2sim.load import load
from asset2sim.load.description import Description, Joint
from asset2sim.load.in_mujoco import MuJoCoObject
from asset2sim.load.in_pybullet import PyBulletObject
from asset2sim.load.loaded import Loaded
from asset2sim.load.shapes import points_of, vector_of

VISIBLE = 0.01
"""Share of its range, or of a turn, after which a part has been moved."""


@dataclass(frozen=True)
class Felt:
    """As a hand finds it in one engine: the largest of the forces (N) at its edge that move it from shut, 0.2 of the
    way on (``then_n``), how far (share of its way, of a turn) from the start it is 2 s after it is left at 0.6 and at
    0.4, and how far it swings on from 1 rad/s in the middle, degrees."""

    engine: str
    force_n: float
    then_n: float
    from_more: float
    from_less: float
    swings_deg: float


@dataclass(frozen=True)
class Hand:
    """A hand at one joint: where it finds the part, its signed way from there, and the reach of its edge (m; 1 for a
    slider)."""

    world: Loaded
    joint: Joint
    shut: float
    way: float
    arm: float

    def at(self, share: float) -> float:
        return self.shut + share * self.way

    def put(self, share: float) -> None:
        self.world.reset()
        self.world.set_positions({self.joint.name: self.at(share)})

    def position(self) -> float:
        return self.world.positions()[self.joint.name]

    def left(self, share: float) -> float:
        """Where it is 2 s after it was left at a share of its way."""
        self.put(share)
        for _ in range(480):
            self.world.step()
        return (self.position() - self.shut) / self.way

    def moves(self, effort: float, share: float) -> bool:
        """Whether an effort of 1 s moves it visibly."""
        self.put(share)
        self.world.apply_effort({self.joint.name: effort})
        for _ in range(240):
            self.world.step()
            if (self.position() - self.at(share)) * np.sign(effort) > VISIBLE * abs(self.way):
                return True
        return False

    def force(self, share: float) -> float:
        """The larger of the forces (N) at its edge that move it either way; from shut, the one that opens it."""
        return max(
            self.least(sign, share) for sign in ((1.0, -1.0) if share > 0.0 else (math.copysign(1.0, self.way),))
        )

    def least(self, sign: float, share: float) -> float:
        low = high = 0.0
        for high in (0.5, 1.5, 5.0, 15.0, 50.0, 150.0, 500.0):
            if self.moves(sign * high * self.arm, share):
                break
            low = high
        for _ in range(6):
            middle = (low + high) / 2.0
            low, high = (low, middle) if self.moves(sign * middle * self.arm, share) else (middle, high)
        return high

    def swings_deg(self) -> float:
        """How far it swings on from 1 rad/s at 0.3 of its way; NaN for a slider."""
        if self.joint.type == "prismatic":
            return math.nan
        self.put(0.3)
        kick(self.world, self.joint.name, math.copysign(1.0, self.way))
        for _ in range(960):
            self.world.step()
        return math.degrees(abs(self.position() - self.at(0.3)))


def felt(folder: Path, engine: str) -> Felt:
    """The one joint of a refined object, its root held, pushed and let go through ``asset2sim.load``."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        world = load(folder, engine, fixed=True, position=(0.0, 0.0, 5.0))
    (one,) = world.about.joints
    shut, way = one.initial_position, 2.0 * math.pi
    if one.lower is not None:
        # A button's pressed end may be called closed: a hand starts from the end where it finds the part.
        ends = (one.closed, one.open)
        first, last = ends if abs(shut - one.open) > 0.01 * abs(one.open - one.closed) else ends[::-1]
        shut, way = first, last - first
    hand = Hand(world, one, shut, way, edge(world.about, one))
    return Felt(engine, hand.force(0.0), hand.force(0.2), hand.left(0.6), hand.left(0.4), hand.swings_deg())


def kick(world: Loaded, name: str, speed: float) -> None:
    """Give one joint a speed, rad/s, in MuJoCo or PyBullet."""
    if isinstance(world, PyBulletObject):
        world.bullet.resetJointState(world.body, world.joints[name], world.positions()[name], speed, **world.at)
    elif isinstance(world, MuJoCoObject):
        world.data.joint(name).qvel[0] = speed


def edge(about: Description, one: Joint) -> float:
    """Furthest reach of the part from its axis, m; 1 for a slider."""
    if one.type == "prismatic":
        return 1.0
    part = next(item for item in about.urdf.findall("link") if item.get("name") == one.link)
    hinge = next(item for item in about.urdf.findall("joint") if item.get("name") == one.name)
    axis = vector_of(hinge.find("axis"), "xyz", "1 0 0")
    return float(np.linalg.norm(np.cross(points_of(part, "collision"), axis / np.linalg.norm(axis)), axis=1).max())
