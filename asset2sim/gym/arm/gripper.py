"""The grippers that the arm may have: their lengths, and what their servos and joints are at an opening."""

from collections.abc import Callable
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from asset2sim.physics.arrays import Array
from schemas.errors import UnknownChoiceError


@dataclass(frozen=True, eq=False)
class Gripper:
    """A gripper whose two fingers open along y of the hand's frame. Lengths in m: ``tip_m`` of the point between the
    finger pads from the hand's frame, along its z axis; ``opening_m`` between open pads; ``finger_m`` and ``pad_m``
    half the thickness of its closed tips and half the width of one; ``lowest_m`` the least height of the point over a
    floor. ``tips`` are the bodies that are meant to touch. ``servos`` makes (n, k) commands of (n,) openings, m,
    ``opened`` an opening of its joints' positions; (joints, k) ``ratios`` times the commands are the positions to which
    these lead."""

    name: str
    tip_m: float
    opening_m: float
    finger_m: float
    pad_m: float
    lowest_m: float
    tips: tuple[str, ...]
    servos: Callable[[Array], Array]
    opened: Callable[[Array], float]
    ratios: Array

    def opening_of(self, commands: Array) -> float:
        """The opening to which (k,) commands lead, m."""
        return self.opened(self.ratios @ commands)


PIVOT_M = 0.0306011
"""Of the Robotiq: half the distance between the knuckles' pivots; all of it as robosuite's MJCF has it."""
CRANK_M = (0.0376, 0.043)
"""From there to the finger's pivot when open, y and z: the two sides of its parallelograms turn, the fingers do not."""
PAD_FACE_M = 0.0255203
"""From the finger's pivot inwards to the face of its pad."""
CLOSED_RAD = 0.8
"""Angle of the closed knuckles; the pads are then 0.9 mm apart."""
RADIUS_M, ANGLE_RAD = float(np.hypot(*CRANK_M)), float(np.arctan2(CRANK_M[1], CRANK_M[0]))


def knuckle_of(opening: Array) -> Array:
    """(n, 1) angle of the Robotiq's knuckles, rad, at (n,) openings, m."""
    across = (np.atleast_1d(opening) / 2.0 - PIVOT_M + PAD_FACE_M) / RADIUS_M
    found: Array = np.clip(np.arccos(across) - ANGLE_RAD, 0.0, CLOSED_RAD)[:, None]
    return found


def opening_at(joints: Array) -> float:
    """The Robotiq's opening, m, at (6,) joint positions, rad."""
    return float((PIVOT_M - PAD_FACE_M + RADIUS_M * np.cos(joints[[0, 3]] + ANGLE_RAD)).sum())


PANDA = Gripper(
    "panda", tip_m=0.1034, opening_m=0.08, finger_m=0.011, pad_m=0.008, lowest_m=0.008,
    tips=("panda_leftfinger", "panda_rightfinger"),
    servos=lambda opening: np.repeat(np.atleast_1d(opening)[:, None] / 2.0, 2, axis=1),
    opened=lambda joints: float(joints.sum()), ratios=np.eye(2),
)  # fmt: skip
"""The arm's own: two sliding fingers with a servo each."""
ROBOTIQ = Gripper(
    "robotiq", tip_m=0.15, opening_m=0.085, finger_m=0.011, pad_m=0.011, lowest_m=0.015,
    tips=("left_inner_finger", "right_inner_finger"), servos=knuckle_of, opened=opening_at,
    ratios=np.array([[1.0], [-1.0], [1.0], [1.0], [-1.0], [1.0]]),
)  # fmt: skip
"""Robotiq 2F-85: two fingers on parallelograms, one servo. Its joints are, left then right, the outer knuckle, the
finger and the inner knuckle. Closing moves the tips 14 mm away from the hand; ``tip_m`` is within the pads wherever
something of up to 73 mm is held."""
GRIPPERS = MappingProxyType({gripper.name: gripper for gripper in (PANDA, ROBOTIQ)})


def gripper_of(name: str) -> Gripper:
    """The gripper of this name. Raises UnknownChoiceError where there is none."""
    if name not in GRIPPERS:
        raise UnknownChoiceError("gripper", name, GRIPPERS)
    return GRIPPERS[name]
