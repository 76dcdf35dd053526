"""Holds of a part: where a hand presses, hooks or grasps it so that it goes a way, found from its collision shapes."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from asset2sim.gym.hand.gripper import HandWorld
from asset2sim.gym.hand.poses import TURNS, Kind, SolidPlaces, at_places
from asset2sim.gym.hand.surfaces import (
    REACH_M,
    places_before_back,
    places_inside,
    share_between_pads,
    share_of_rubbing,
    surface_places,
)
from asset2sim.gym.world import body_pose, body_subtree
from asset2sim.physics.arrays import Array

LOOKED_AT: Mapping[Kind, int] = {"press": 200, "grasp": 1000, "hook": 700, "rub": 700}
"""Holds of each kind for which it is looked whether the hand fits there; to rub, a finger presses on what goes along
it, an edge or a face, and is looked for where no other fits or one has failed."""
SPREAD = 0.3
"""Random share of what makes a hold worth looking at: the best of all are often alike, and all in a corner."""
ENOUGH, KEPT = 8, 4
"""Holds of a kind that fit, after which no more are looked at, and those that are handed on."""
BEND_RAD = math.radians(60.0)
"""How far a wrist bends."""
ARM_M, BEHIND_M = 0.02, 0.09
"""Half the thickness of the wrist, and how far behind the pads' middle it begins, m."""
CLEAR_M = 0.05
"""How far off the hand begins, m."""
INTO_M, BESIDE_M = 0.003, 0.0005
"""How deep a hand's box may be in the part and in anything else where it is looked at, m."""
OF_PART, HAND_M = 150, 0.15
"""Places of the part at which no hand may be, by which most of its poses are told to be none, and how far from a part
the hand that holds it reaches, m."""
SHARES = (0.15, 0.4, 0.7, 1.0)
"""Shares of the way at which it is looked whether the hand still fits."""
FACING = 0.6
"""Least cosine between a push and a surface's inner normal: friction of 0.8 holds up to 39°, and the rest is room."""
ALONG, RUB_M = 0.3, 0.01
"""Most cosine between the part's way and the normal of what is rubbed, and how far a finger is led into it, m: with
half of that ahead, friction holds, of 1 and of 0.6."""
BARELY, HELD = 0.5, 1.0 / 3.0
"""Worth that a grasp loses with nothing between its pads, and the share of these that is enough: a rod's."""
SLIPPED = 0.5
"""Worth that a kind of hold loses each time that one slipped."""
APART_M, SMALL = 0.02, 0.25
"""Distance from which on two holds are different, m, and the share of a small part's length that is as much."""


@dataclass(frozen=True, eq=False)
class HandHold:
    """One hold: the hand's (4, 4) pose in the frame of a ``body``, half the opening with which it comes, m, its score,
    the share of the way on which the hand has room, and the way, m, in which it presses on what it rubs."""

    kind: Kind
    body: int
    pose: Array
    half_open_m: float
    score: float
    room: float
    into: Array


@dataclass(frozen=True, eq=False)
class Way:
    """The way of a joint to a target (rad or m): its axis and anchor in the world, and the ``bodies`` moved."""

    joint: str
    slides: bool
    axis: Array
    anchor: Array
    start: float
    target: float
    bodies: frozenset[int]

    @property
    def sign(self) -> float:
        """1 where the position grows."""
        return math.copysign(1.0, self.target - self.start)

    def motion(self, by: float) -> Array:
        """(4, 4) motion of the part in the world as its joint goes by that much, rad or m."""
        return axis_motion(self.slides, self.axis, self.anchor, by)

    def velocity(self, points: Array) -> Array:
        """(n, 3) velocities of (n, 3) points as the joint goes towards its target at 1 rad/s or m/s."""
        if self.slides:
            return np.tile(self.sign * self.axis, (len(points), 1))
        return np.asarray(self.sign * np.cross(self.axis, points - self.anchor))


def axis_motion(slides: bool, axis: Array, anchor: Array, by: float) -> Array:
    """(4, 4) motion along, or about, an axis through an anchor by that much, m or rad."""
    moved = np.eye(4)
    if slides:
        moved[:3, 3] = by * axis
        return moved
    quaternion = np.zeros(4)
    mujoco.mju_axisAngle2Quat(quaternion, axis, by)
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, quaternion)
    moved[:3, :3] = turn.reshape(3, 3)
    moved[:3, 3] = anchor - moved[:3, :3] @ anchor
    return moved


def way_of(world: HandWorld, joint: str, target: float) -> Way:
    """The way of a joint from where it is."""
    number = world.joint(joint)
    model, data = world.model, world.data
    slides = bool(model.jnt_type[number] == mujoco.mjtJoint.mjJNT_SLIDE)
    bodies = body_subtree(model, int(model.jnt_bodyid[number]))
    mujoco.mj_kinematics(model, data)
    axis, anchor = data.xaxis[number].copy(), data.xanchor[number].copy()
    return Way(joint, slides, axis, anchor, world.position(joint), target, bodies)


def best_holds(
    world: HandWorld, way: Way, near: Array | None, avoid: Sequence[Array], slipped: Sequence[Kind] = ()
) -> list[HandHold]:
    """The best holds, each at another place, of which none is at a place (in its body's frame) to avoid; kinds that
    ``slipped`` come after others. ``near`` is where people take hold of the part, in the frame of the joint's own
    body."""
    points, normals, bodies = surface_places(world, way.bodies)
    velocity = way.velocity(points) if len(points) else points
    lever = np.linalg.norm(velocity, axis=1)
    if not (lever > 0.0).any():
        return []
    push = -np.einsum("ij,ij->i", normals, velocity) / np.maximum(lever, 1e-9)
    worth = 0.6 * lever / float(lever.max())
    if near is not None:
        body = body_pose(world.data, min(way.bodies))
        off = np.linalg.norm(points - (body[:3, :3] @ near + body[:3, 3]), axis=1)
        worth = worth - 0.5 * np.minimum(off / max(float(np.ptp(points, axis=0).max()), 1e-3), 1.0)
    most = world.tool.opening_m - world.tool.room_m
    pushed, along = np.flatnonzero(push > FACING), np.flatnonzero(np.abs(push) < ALONG)
    grasped, widths = places_before_back(world, points, normals, way.bodies, most)
    width = np.zeros(len(points))
    width[grasped] = widths
    scores = {
        "press": (pushed, worth[pushed] + 0.3 * push[pushed] + 0.35),
        "hook": (pushed, worth[pushed] + 0.2 * push[pushed]),
        "grasp": (grasped, worth[grasped] + 0.2 * np.abs(push[grasped]) - 0.3 * widths / most + 0.15),
        "rub": (along, worth[along]),
    }
    apart = apart_m(world, points)
    rng, fits, found_at = np.random.default_rng(0), list[HandHold](), (points, normals, bodies, width)
    solid = solid_of(world, way.bodies, points)
    for kind in LOOKED_AT:
        if kind != "rub" or avoid or not fits:
            fits += holds_with_room(world, way, kind, found_at, scores[kind], avoid, solid, rng)
    kept: list[HandHold] = []
    for hold in sorted(fits, key=lambda hold: SLIPPED * slipped.count(hold.kind) - hold.score):
        places = [one.pose[:3, 3] - hold.pose[:3, 3] for one in kept]
        if len(kept) < KEPT and all(off @ off >= apart**2 for off in places):
            kept.append(hold)
    return kept


def apart_m(world: HandWorld, points: Array) -> float:
    """Distance from which on two holds of a part of these (n, 3) places are different, m."""
    return min(APART_M * world.scale, SMALL * float(np.ptp(points, axis=0).max()))


def holds_with_room(
    world: HandWorld, way: Way, kind: Kind, found_at: tuple[Array, Array, NDArray[np.int64], Array],
    scores: tuple[NDArray[Any], Array],
    avoid: Sequence[Array], solid: SolidPlaces, rng: np.random.Generator,
) -> list[HandHold]:  # fmt: skip
    """Some holds of a kind for which the hand has room, of the best by ``scores`` (the numbers of the places, and how
    good each is); ``found_at`` are all places, normals, bodies, and how thick it is there, m."""
    (points, normals, bodies, width), (chosen, score), found = found_at, scores, list[HandHold]()
    turns = 1 if kind == "press" else 2 * TURNS  # with the middle of its pads there, and with their tips
    chosen, score = np.repeat(chosen, turns), np.repeat(score, turns)
    best = np.argsort(-score - SPREAD * rng.random(len(score)))[: LOOKED_AT[kind]]
    places, turned = chosen[best], best % turns
    poses, halves = at_places(world, kind, points[places], normals[places], turned, width[places])
    frames = {int(body): body_pose(world.data, int(body)) for body in np.unique(bodies[places])}
    apart = apart_m(world, points)
    for index in solid.free(world, poses, halves, CLEAR_M * world.scale):
        place, pose, half = int(places[index]), poses[index], float(halves[index])
        body = int(bodies[place])
        there = frames[body][:3, :3].T @ (pose[:3, 3] - frames[body][:3, 3])
        if any(float(np.linalg.norm(there - other)) < apart for other in avoid):
            continue
        room, into = room_of(world, way, pose, half), normals[place] * (-RUB_M if kind == "rub" else 0.0)
        if room is not None and (kind != "rub" or share_of_rubbing(world, pose, into, way.bodies) > 0.0):
            local, into = np.linalg.inv(frames[body]) @ pose, frames[body][:3, :3].T @ into
            worth = float(score[best[index]]) + 0.8 * room
            if kind == "grasp":
                worth -= BARELY * max(0.0, 1.0 - share_between_pads(world, pose, half, way.bodies) / HELD)
            found.append(HandHold(kind, body, local, half, worth, room, into))
        if len(found) >= ENOUGH:
            break
    return found


def solid_of(world: HandWorld, bodies: frozenset[int], points: Array) -> SolidPlaces:
    """Places of the object where no hand may be that holds these ``bodies``, some of whose places are taken."""
    others = frozenset(range(world.model.nbody)) - body_subtree(world.model, world.body) - bodies
    some = [points[:OF_PART], places_inside(world, others, points, HAND_M * world.scale)]
    floors = (world.model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE) & (world.probe.geom_conaffinity != 0)
    floor_m = float(world.data.geom_xpos[floors, 2].max()) - BESIDE_M if floors.any() else -math.inf
    return SolidPlaces(np.concatenate(some), np.repeat([0.4 * INTO_M, BESIDE_M], [len(part) for part in some]), floor_m)


def room_of(world: HandWorld, way: Way, pose: Array, half_open_m: float) -> float | None:
    """Share of the way on which the hand meets nothing; None where it cannot pose so, or no arm has room."""
    data = world.spare
    data.qpos[:] = world.data.qpos
    for back in (0.0, 0.5, 1.0):
        there = pose.copy()
        there[:3, 3] -= back * CLEAR_M * world.scale * pose[:3, 2]
        if runs_into(world, way, there, half_open_m, INTO_M * (0.2 if back else 0.4)):
            return None
    if not has_arm_room(world, there, half_open_m):
        return None
    number, free = world.joint(way.joint), 0.0
    place = world.place(way.joint)
    place += 2 if world.model.jnt_type[number] == mujoco.mjtJoint.mjJNT_FREE else 0  # the whole object goes upwards
    for share in SHARES:
        by = share * (way.target - way.start)
        data.qpos[place] = way.start + by
        if runs_into(world, way, way.motion(by) @ pose, half_open_m, INTO_M):
            break
        free = share
    return free if free > 0.0 else None


def has_arm_room(world: HandWorld, pose: Array, half_open_m: float) -> bool:
    """Whether an arm has room behind each hand: else the hand would be inside the object."""
    tool = world.tool
    if tool.hands == 1:
        return arm_fits(world, pose, pose[:3, 3] - BEHIND_M * world.scale * pose[:3, 2])
    out, back = (half_open_m + tool.finger[1]) * pose[:3, 1], (tool.behind_m - ARM_M) * pose[:3, 2]
    return all(arm_fits(world, pose, pose[:3, 3] + back + side * out) for side in (1.0, -1.0))


def arm_fits(world: HandWorld, pose: Array, behind: Array) -> bool:
    """Whether an arm has room from where it begins ``behind`` a hand of this pose, in one of some directions."""
    across = ARM_M * world.scale * pose[:3, 0]
    for turn in range(-1, TURNS):
        angle, bend = 2.0 * math.pi * turn / TURNS, 0.0 if turn < 0 else BEND_RAD
        side = math.cos(angle) * pose[:3, 0] + math.sin(angle) * pose[:3, 1]
        towards = math.sin(bend) * side - math.cos(bend) * pose[:3, 2]
        sources = (behind, behind + across, behind - across)
        if all(world.first_met(one, towards, world.body, world.spare)[0] >= REACH_M for one in sources):
            return True
    return False


def runs_into(world: HandWorld, way: Way, pose: Array, half_open_m: float, into_m: float) -> bool:
    """Whether the hand, there, is deeper in the part than ``into_m``, or in anything else."""
    data, probe = world.spare, world.probe
    world.put(data, pose, half_open_m)
    mujoco.mj_kinematics(probe, data)
    mujoco.mj_collision(probe, data)
    for number in range(data.ncon):
        contact = data.contact[number]
        of_part = any(int(probe.geom_bodyid[geom]) in way.bodies for geom in contact.geom)
        if contact.dist < -(into_m if of_part else BESIDE_M):
            return True
    return False


def cross(a: Array, b: Array) -> Array:
    """(3,) vector product of two vectors."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
