"""Opening effort: the least force or torque that moves each joint towards its open end, and towards its closed one."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from asset2sim.checks.joint_groups import depth_groups
from asset2sim.checks.mechanism import Mechanism, moved_inertia, poses_at, pull_on, span_of
from asset2sim.engines.world import World
from asset2sim.physics.arrays import Array
from asset2sim.physics.mass_matrix import joint_space
from schemas.interaction import Opening
from schemas.overlay import JointPhysics
from schemas.settings import EngineSettings

VISIBLE_RAD = 2e-3
"""How far a hinge moves before it counts as moved, rad: 1 mm at the edge of a door half a metre wide ..."""
VISIBLE_M = 5e-4
"""... or a slider, m ..."""
VISIBLE_SHARE = 0.02
"""... and at most this share of its range: a key's whole travel is 3 mm."""
CLICK_SHARE = 0.25
"""Share of the way between two clicks to which a selector is turned: there its detent is at its most, whether it stays
so up to half the way (``load``, our checks) or falls again as a sine does (MJCF). Friction alone moves it visibly."""
SEATED_S = 0.1
"""How long parts come to rest on their ends before they are pushed, s: gravity takes a light one by 3 mrad into its
limit in the first step, which throws what hangs on it the other way."""
ENOUGH = 1.5
"""Where the first ramp ends, as a multiple of the predicted effort."""
HARDER = 10.0
"""Factor by which each further ramp ends higher, up to the effort limit."""
LEAST_RAD_S2 = 1.0
"""Least acceleration at the end of the first ramp, rad/s² or m/s²: a joint may have neither friction nor load."""
LEAST_SHARE = 1e-4
"""Least end of the first ramp, as a share of the effort limit: an authored link may have no mass."""
DEFAULT_LIMIT = 100.0
"""Effort limit of a joint whose URDF states none, N·m or N."""


@dataclass(frozen=True)
class Push:
    """One joint to be pushed in one direction (±1): ``first`` and ``limit`` are efforts, N·m or N, ``visible`` the
    motion that counts (rad or m), ``inertia`` what moves, root held (kg·m² or kg), ``coupled`` what each other joint's
    acceleration takes of the effort or adds to it: the second leaf of a door folds as the first is pushed."""

    joint: JointPhysics
    direction: float
    first: float
    limit: float
    visible: float
    inertia: float
    coupled: Mapping[str, float] = field(default_factory=dict)


def openings(
    world: World, item: Mechanism, settings: EngineSettings, names: Collection[str] | None = None, settle_s: float = 0.0
) -> tuple[Opening, ...]:
    """The least efforts of every joint, or of those ``names``, from its initial position, independent joints together;
    the root is held, or settles on the world's plane for ``settle_s`` first."""
    poses, space = poses_at(item, item.start), joint_space(item.tree, item.root, item.bodies, item.start)
    shares = dict(zip(space.names, space.matrix[6:, 6:], strict=True))
    found: dict[tuple[str, float], float | None] = {}
    asked = [joint for joint in item.asked if names is None or joint.name in names]
    for group in depth_groups(item, [joint.name for joint in asked]):
        joints = [joint for joint in item.joints if joint.name in group]
        for direction in (1.0, -1.0):
            pushes = []
            for joint in joints:
                pull = float(pull_on(item, joint.name, item.start, poses).at(joint.initial_position))
                push = push_of(joint, direction, pull, moved_inertia(item, joint.name, poses), item)
                if push is not None:
                    alone = {joint.name, *(entry.name for entry in item.followers.get(joint.name, ()))}
                    row = zip(space.names, map(float, shares[joint.name]), strict=True)
                    pushes.append(replace(push, coupled={name: x for name, x in row if x and name not in alone}))
            efforts = least_efforts(world, item, pushes, settings, settle_s)
            found |= {(name, direction): effort for name, effort in efforts.items()}
    return tuple(record(joint, item, found) for joint in asked)


def record(joint: JointPhysics, item: Mechanism, found: dict[tuple[str, float], float | None]) -> Opening:
    """The record of one joint; ``stuck`` where it has room in a direction and no effort up to its limit moves it."""
    opens = 1.0 if joint.open >= joint.closed else -1.0
    return Opening(
        joint=joint.name,
        opening=found.get((joint.name, opens)),
        closing=found.get((joint.name, -opens)),
        effort_limit=limit_of(item, joint.name),
        stuck=any(found.get((joint.name, way), 0.0) is None for way in (1.0, -1.0)),
    )


def limit_of(item: Mechanism, joint: str) -> float:
    """The joint's effort limit, N·m or N."""
    stated = item.efforts.get(joint, 0.0)
    return stated if np.isfinite(stated) and stated > 0.0 else DEFAULT_LIMIT


def push_of(joint: JointPhysics, direction: float, pull: float, inertia: float, item: Mechanism) -> Push | None:
    """The push of one joint in one direction, or None where it has no room to move visibly there."""
    lower, upper = span_of(joint)
    visible = min(VISIBLE_M if joint.type == "prismatic" else VISIBLE_RAD, VISIBLE_SHARE * max(upper - lower, 0.0))
    if joint.bias is not None and joint.bias.period > 0.0:
        visible = CLICK_SHARE * joint.bias.period
    room = (upper - joint.initial_position) if direction > 0.0 else (joint.initial_position - lower)
    if visible <= 0.0 or room < visible:
        return None
    spring = joint.exerted(joint.initial_position + direction * visible)
    needed = joint.friction - direction * (pull + spring)
    limit = limit_of(item, joint.name)
    first = max(ENOUGH * max(needed, LEAST_RAD_S2 * inertia), LEAST_SHARE * limit)
    return Push(joint, direction, min(first, limit), limit, visible, inertia)


def least_efforts(
    world: World, item: Mechanism, pushes: Sequence[Push], settings: EngineSettings, settle_s: float
) -> dict[str, float | None]:
    """Joint → the least effort that moves it, N·m or N, or None where its effort limit does not. The effort is raised
    from 0 to a little over the predicted one, then in further ramps to ever more."""
    found: dict[str, float | None] = {}
    waiting = [(push, push.first) for push in pushes]
    while waiting:
        efforts = ramp(world, item, [push for push, _ in waiting], [most for _, most in waiting], settings, settle_s)
        found |= efforts
        waiting = [
            (push, min(HARDER * most, push.limit))
            for push, most in waiting
            if efforts[push.joint.name] is None and most < push.limit
        ]
    return found


def ramp(
    world: World,
    item: Mechanism,
    pushes: Sequence[Push],
    most: Sequence[float],
    settings: EngineSettings,
    settle_s: float,
) -> dict[str, float | None]:
    """Raise every push's effort from 0 to ``most`` over ``push_s``; the effort at which each joint has moved visibly.
    One that ends at a joint's limit stays there as long again: a heavy door takes its time.

    The joint then has some speed: the effort that its damper and inertia take is subtracted, so that the result is the
    effort for slow motion. Without that it would grow with the speed of the ramp.
    """
    order = {name: index for index, name in enumerate(world.joint_names)}
    indices = [order[push.joint.name] for push in pushes]
    world.place(item.start)
    placed = world.positions()[indices]
    world.step(round(max(settle_s, SEATED_S) / world.timestep_s))
    ways = np.array([push.direction for push in pushes])
    ends = np.array(most)
    visible = np.array([push.visible for push in pushes])
    if settle_s == 0.0 and np.any(np.abs(world.positions()[indices] - placed) >= visible):
        world.place(item.start)  # What falls by itself is pushed where it starts.
    start, (place, turn) = world.positions()[indices], world.root_pose()
    slides = np.array([push.joint.type == "prismatic" for push in pushes])
    found: dict[str, float | None] = {push.joint.name: None for push in pushes}
    steps = max(1, round(settings.push_s / world.timestep_s))
    before = world.velocities()
    stays = any(end >= push.limit for end, push in zip(most, pushes, strict=True))
    for step in range(1, steps * (2 if stays else 1) + 1):
        efforts = ends * min(1.0, step / steps)
        live = [i for i, push in enumerate(pushes) if found[push.joint.name] is None]
        if not live:
            break
        world.push({pushes[i].joint.name: float(ways[i] * efforts[i]) for i in live})
        world.step()
        speeds = world.velocities()
        moved = (world.positions()[indices] - start) * ways >= visible
        if settle_s > 0.0:
            # What stays on the floor while the rest of the object slides from under it has not been moved.
            now, turned = world.root_pose()
            back = np.where(slides, np.linalg.norm(now - place), angle_of(turned, turn))
            moved &= (world.positions()[indices] - start) * ways >= visible + back
        for i in live:
            if moved[i]:
                gaining = dict(zip(order, (speeds - before) / world.timestep_s, strict=True))
                found[pushes[i].joint.name] = slow_effort(pushes[i], efforts[i], speeds[indices[i]], gaining)
        before = speeds
    return found


def angle_of(a: Array, b: Array) -> float:
    """The angle between two orientations, unit xyzw quaternions, rad."""
    return float(2.0 * np.arccos(min(1.0, abs(float(a @ b)))))


def slow_effort(push: Push, effort: float, speed: float, gaining: Mapping[str, float]) -> float:
    """The effort less what the damper takes at the joint's speed, its inertia at its acceleration and that of the
    joints that it is coupled to, at least 0; ``gaining`` are the accelerations of all joints."""
    inertial = push.inertia * gaining[push.joint.name] + sum(m * gaining[name] for name, m in push.coupled.items())
    slow = effort - push.direction * (push.joint.damping * speed + inertial)
    return float(max(0.0, slow)) if np.isfinite(slow) else 0.0
