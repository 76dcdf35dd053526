"""Where a gripper takes hold of a part at its handle or edge, to pull it open, found by rays from geometry alone."""

import math
from collections.abc import Iterator
from itertools import product

import numpy as np

from asset2sim.gym.arm.paths import PACE_M, ToolPath
from asset2sim.gym.arm.scene import CompiledScene, place_joints
from asset2sim.gym.world import body_pose, welded_bodies
from asset2sim.physics.arrays import Array
from schemas.overlay import JointPhysics

ROOM_M = 0.006
"""Room left on either side between an open finger and the object, m."""
SLANT_M, BEHIND_M = 0.006, 0.024
"""Differences in distance over a finger's width between which a surface slants: friction holds up to 20 degrees."""
REACH_M = 0.1
"""Height over the finger tips in which nothing may be beside what they hold, m."""


def material_between(
    stage: CompiledScene, hold: Array, across: Array, firmly: frozenset[int], back: Array
) -> tuple[float, float, bool] | None:
    """Material between the fingers about a place, from and to, m along ``across``, and whether it is of the bodies
    ``firmly`` alone; None where nothing is, or where a finger that comes against ``back`` runs into something."""
    side, most, pad = np.cross(back, across), stage.gripper.opening_m, stage.gripper.pad_m
    ends, firm = [], True
    for sign in (-1.0, 1.0):
        nearest = []
        for offset, rise in product((-pad, 0.0, pad), (0.0, 0.012)):
            source = hold + sign * across * most / 2.0 + side * offset + back * rise
            if stage.first_met(source + back * REACH_M, -back)[0] < REACH_M:
                return None
            distance, geom = stage.first_met(source, -sign * across)
            if distance < most and stage.object_geoms[geom]:
                nearest.append(distance)
                firm &= int(stage.model.geom_bodyid[geom]) in firmly
        if not nearest or min(nearest) < ROOM_M or is_askew(nearest):
            return None
        ends.append(sign * (most / 2.0 - min(nearest)))
    return (ends[0], ends[1], firm) if ends[0] < ends[1] else None


def is_askew(distances: list[float]) -> bool:
    """Whether a surface lies so askew to a finger that it would slide off; what is much further away is another."""
    nearest = min(distances)
    return any(SLANT_M < distance - nearest < BEHIND_M for distance in distances)


def opened_for(stage: CompiledScene, width: float) -> float:
    """How far the fingers open around something of this width, m."""
    return min(stage.gripper.opening_m, width + 4.0 * ROOM_M)


OFFSETS_M = (0.0, 0.012, -0.012, 0.03, -0.03)
"""How far from the middle of the handle or edge a hold is looked for, across and along it, m."""
PULL_DEPTHS_M = (0.012, 0.02, 0.006)
"""How far behind the front of what is held the finger tips reach, m."""
BEFORE_M = 0.07
"""Distance from which the hand comes, and to which it goes back, m."""
TURNS = 4
"""Directions along which the fingers may close, over half a turn."""


def pull_paths(stage: CompiledScene, joint: JointPhysics, target: float) -> Iterator[ToolPath]:
    """Ways to take hold of a part where hands do and lead it to a target, each with another hold. None where nothing
    there fits between the fingers, or where they have no room."""
    number = stage.joint(joint.name)
    body = int(stage.model.jnt_bodyid[number])
    about = next(item for item in stage.about.joints if item.name == joint.name)
    if about.pull is None:
        return
    here = body_pose(stage.data, body)
    middle = here[:3, :3] @ np.array(about.pull) + here[:3, 3]
    axis, anchor = stage.data.xaxis[number].copy(), stage.data.xanchor[number].copy()
    way = math.copysign(1.0, target - joint.initial_position)
    out = way * (axis if joint.type == "prismatic" else np.cross(axis, middle - anchor))
    out /= max(float(np.linalg.norm(out)), 1e-9)
    first = np.cross(out, np.array([0.0, 0.0, 1.0]) if abs(out[2]) < 0.9 else np.array([1.0, 0.0, 0.0]))
    first /= float(np.linalg.norm(first))
    second = np.cross(out, first)
    bodies = welded_bodies(stage.model, body)
    for across_m, along_m, turn in product(OFFSETS_M, OFFSETS_M, range(TURNS)):
        aim = middle + across_m * first + along_m * second
        front, _ = stage.first_met(aim + out * (BEFORE_M + 0.1), -out)
        if math.isinf(front):
            continue
        angle = math.pi * turn / TURNS
        across = math.cos(angle) * second + math.sin(angle) * first
        for depth in PULL_DEPTHS_M:
            hold = aim + out * (BEFORE_M + 0.1 - front - depth)
            span = material_between(stage, hold, across, bodies, out)
            if span is not None and span[2] and span[1] - span[0] <= stage.gripper.opening_m - 2.0 * ROOM_M:
                held = hold + across * (span[0] + span[1]) / 2.0
                yield pull_path(stage, joint, body, held, out, across, (span[1] - span[0], target))
                break


def pull_path(
    stage: CompiledScene,
    joint: JointPhysics,
    body: int,
    held: Array,
    out: Array,
    across: Array,
    width_target: tuple[float, float],
) -> ToolPath:
    """The way of one hold: to it, close, along with the part, open, and back; hand and part turn together."""
    (width, target), start = width_target, joint.initial_position
    place_joints(stage, {joint.name: start})
    here = body_pose(stage.data, body)
    turn, origin = here[:3, :3].T, here[:3, 3]
    local, local_out, local_across = turn @ (held - origin), turn @ out, turn @ across
    arm = float(np.linalg.norm(held - stage.data.xanchor[stage.joint(joint.name)]))
    length = abs(target - start) * (1.0 if joint.type == "prismatic" else max(arm, 0.02))
    at = [start] * 3 + list(np.linspace(start, target, max(4, math.ceil(length / PACE_M)))) + [target] * 2
    open_m = opened_for(stage, width)
    moving = len(at) - 5
    phases = ("approach", "approach", "grip", *["open"] * moving, "release", "retreat")
    opening = np.array([open_m, open_m, *[0.0] * (moving + 1), open_m, open_m])
    points, axes, sides = [], [], []
    for position in at:
        place_joints(stage, {joint.name: float(position)})
        pose = body_pose(stage.data, body)
        points.append(pose[:3, :3] @ local + pose[:3, 3])
        axes.append(-pose[:3, :3] @ local_out)
        sides.append(pose[:3, :3] @ local_across)
    place_joints(stage, {joint.name: start})
    points[0], points[-1] = points[0] - axes[0] * BEFORE_M, points[-1] - axes[-1] * BEFORE_M
    return ToolPath(np.array(points), np.array(axes), np.array(sides), opening, phases, np.array(at))
