"""Where a gripper takes hold of an object, found by rays from geometry alone: from above, to lift it into a bowl, or at
a handle or edge, to pull a shut part open along its arc."""

import math
from collections.abc import Iterator
from itertools import pairwise, product

import numpy as np

from asset2sim.gym.arm.paths import PACE_M, ToolPath, vertices
from asset2sim.gym.arm.scene import BOWL_HIGH_M, BOWL_RADIUS_M, Bowl, CompiledScene, place_joints
from asset2sim.gym.world import body_pose, welded_bodies
from asset2sim.physics.arrays import Array
from schemas.overlay import JointPhysics

DIRECTIONS = 8
"""Directions along which the fingers may close, over half a turn."""
SPREAD = (0.0, 0.15, -0.15, 0.3, -0.3, 0.42, -0.42)
"""Where over the object a hold is looked for, shares of its extent from its middle."""
DEPTHS_M = (0.035, 0.02, 0.012)
"""How far below the top of what is there the finger tips reach, m, deepest first."""
ROOM_M = 0.006
"""Room left on either side between an open finger and the object, m."""
SLANT_M, BEHIND_M = 0.006, 0.024
"""Differences in distance over a finger's width between which a surface slants: friction holds up to 20 degrees."""
REACH_M = 0.1
"""Height over the finger tips in which nothing may be beside what they hold, m."""
LIFT_M, ABOVE_BOWL_M = 0.12, 0.04
"""How high the object is lifted, and how far its lowest point stays above the bowl's rim until it is let go of."""
LOOSE_COST = 0.2
"""Metres of width that a hold of the heaviest part is worth over one of a lid or a handle, which gives way."""
CENTER_WEIGHT = 0.6
"""Metres of width that a metre of distance from the centre of mass is worth: a hold off the middle turns the object."""


def bowl_for(stage: CompiledScene) -> Bowl:
    """The bowl, of the same size for every object, beside it."""
    points = vertices(stage, frozenset(range(1, stage.model.nbody)))
    low, high = points.min(axis=0), points.max(axis=0)
    reach = max(BOWL_RADIUS_M, 0.5 * float(np.linalg.norm((high - low)[:2])))
    middle = (low + high) / 2.0
    return Bowl((float(middle[0]), float(high[1]) + reach + 0.1), BOWL_RADIUS_M, BOWL_HIGH_M)


def grasp_paths(stage: CompiledScene, bowl: Bowl) -> Iterator[ToolPath]:
    """Ways to lift the object into the bowl, each with another hold, the narrowest and nearest to its centre of mass
    first. None where nothing of it fits between the fingers."""
    points = vertices(stage, frozenset(stage.bodies))
    mass = stage.model.body_mass[stage.bodies]
    center = mass @ stage.data.xipos[stage.bodies] / mass.sum()
    low, high = points.min(axis=0), points.max(axis=0)
    groups = [welded_bodies(stage.model, body) for body in stage.bodies]
    heavy = max(groups, key=lambda group: float(stage.model.body_mass[sorted(group)].sum()))
    found = []
    for x, y in product(SPREAD, SPREAD):
        at = np.array([*((low + high) / 2.0)[:2] + np.array([x, y]) * (high - low)[:2], high[2]])
        at[:2] = center[:2] if x == y == 0.0 else at[:2]
        top = height_at(stage, at, high[2] + 0.1)
        for depth, turn in product(DEPTHS_M, range(DIRECTIONS)) if top > 0.0 else ():
            across = np.array([math.cos(math.pi * turn / DIRECTIONS), math.sin(math.pi * turn / DIRECTIONS), 0.0])
            hold = np.array([at[0], at[1], max(top - depth, stage.gripper.lowest_m)])
            span = material_between(stage, hold, across, heavy, np.array([0.0, 0.0, 1.0]))
            if (
                span is not None
                and span[1] - span[0] <= stage.gripper.opening_m - 2.0 * ROOM_M
                and top - hold[2] > 0.004
            ):
                held = hold + across * (span[0] + span[1]) / 2.0
                off = float(np.linalg.norm(held[:2] - center[:2]))
                cost = span[1] - span[0] + CENTER_WEIGHT * off - 0.3 * depth + (0.0 if span[2] else LOOSE_COST)
                found.append((cost, held, across, span[1] - span[0]))
    for _, held, across, width in sorted(found, key=lambda item: item[0]):
        yield lift_path(held, across, opened_for(stage, width), bowl, float(held[2] - low[2]), float(high[2]))


def height_at(stage: CompiledScene, at: Array, top: float) -> float:
    """Height of what is seen from above at a place, m; zero where that is the floor."""
    source = np.array([at[0], at[1], top])
    distance, geom = stage.first_met(source, np.array([0.0, 0.0, -1.0]))
    return float(source[2] - distance) if distance < math.inf and stage.object_geoms[geom] else 0.0


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


def lift_path(held: Array, across: Array, open_m: float, bowl: Bowl, below: float, top: float) -> ToolPath:
    """The way of one hold: down to it, close, up, over the bowl, down, open, up. ``below`` is how far the object
    reaches below the hold, m."""
    up = np.array([0.0, 0.0, 1.0])
    aloft = max(held[2] + LIFT_M, bowl.height_m + below + ABOVE_BOWL_M)
    over = np.array([bowl.at[0], bowl.at[1], aloft])
    lowered = np.array([bowl.at[0], bowl.at[1], max(below + 0.02, held[2])])
    raised = held * np.array([1.0, 1.0, 0.0]) + up * aloft
    first = held + up * max(0.05, top - held[2] + 0.03)
    stops: list[tuple[Array, float, str]] = [
        (first, open_m, "approach"), (held, open_m, "approach"), (held, 0.0, "grip"), (raised, 0.0, "lift"),
        (over, 0.0, "carry"), (lowered, 0.0, "lower"), (lowered, open_m, "release"),
        (lowered + up * 0.12, open_m, "retreat"),
    ]  # fmt: skip
    points, opening, phases = [stops[0][0]], [stops[0][1]], [stops[0][2]]
    for before, after in pairwise(stops):
        count = max(1, math.ceil(float(np.linalg.norm(after[0] - before[0])) / 0.03))
        for share in np.linspace(0.0, 1.0, count + 1)[1:]:
            points.append(before[0] + share * (after[0] - before[0]))
            opening.append(before[1] + share * (after[1] - before[1]))
            phases.append(after[2])
    axes = np.tile(-up, (len(points), 1))
    return ToolPath(
        np.array(points),
        axes,
        np.tile(across, (len(points), 1)),
        np.array(opening),
        tuple(phases),
        np.zeros(len(points)),
    )


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
