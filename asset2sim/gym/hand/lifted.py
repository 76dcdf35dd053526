"""The check ``lifted``: what one hand carries, or both, is lifted and set down, and its joints stay as they should."""

import math
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import mujoco
import numpy as np

from asset2sim.gym.hand.gripper import HandWorld, open_world
from asset2sim.gym.hand.holds import APART_M, CLEAR_M, HandHold, Way, holds_with_room, solid_of
from asset2sim.gym.hand.operate import GRIP_S, PAUSE_S, RELEASE_S, REST_S
from asset2sim.gym.hand.recorder import SAMPLE_STEPS, move_hand, pressed_n, wait
from asset2sim.gym.hand.surfaces import meets_first, places_before_back, surface_places
from asset2sim.gym.world import body_pose, body_subtree, welded_bodies
from asset2sim.physics.arrays import Array
from schemas.hand_settings import HandSettings, LiftSettings
from schemas.learning_settings import GuardSettings
from schemas.overlay import PhysicsOverlay
from schemas.support import SupportKind

STAND_SHARE = 0.3
"""Radius of the stand over the least width of what is on it: it stands there, and juts out by two fifths."""


@dataclass(frozen=True)
class Miss:
    """Why an object was not lifted: whose fault it is, "hand" or "object", and what happened."""

    fault: str
    text: str


@dataclass(frozen=True)
class Lifted:
    """Whether hands carry the object, the share of yaws at which it was lifted and set down, by what, why not."""

    carried: bool
    share: float | None = None
    by: str = ""
    miss: Miss | None = None

    @property
    def reason(self) -> str:
        """The miss in words, empty without one."""
        return f"{self.miss.fault}: {self.miss.text}" if self.miss is not None else ""


@dataclass(eq=False)
class Watch:
    """A world of which is seen how far joints that should stay have ``moved``, over their ranges, and ``most_n``, the
    largest force of a finger, palm or flat hand on the object, N."""

    world: HandWorld
    kept: dict[str, tuple[float, float]]
    """Joint → where it was and its range, rad or m."""
    count: int = 0
    most_n: float = 0.0
    moved: dict[str, float] = field(default_factory=dict)

    def step(self) -> None:
        """A step of the world, and now and then a look."""
        self.world.step()
        self.count += 1
        if self.count % SAMPLE_STEPS == 0:
            self.most_n = max(self.most_n, pressed_n(self.world))
            for name, (start, span) in self.kept.items():
                off = abs(self.world.position(name) - start) / span
                self.moved[name] = max(self.moved.get(name, 0.0), off)


def lift(folder: Path, overlay: PhysicsOverlay, hand: HandSettings, settings: LiftSettings) -> Lifted:
    """The object lifted and set down at each yaw, by the best of some grasps of one hand or, where that does not do it,
    of both. Raises LoadError as ``load`` does, ValueError where MuJoCo refuses the model."""
    if overlay.support.fixed:
        return Lifted(False)
    best, miss, wide, heavier = Lifted(False), None, 0.0, overlay.mass_kg / hand.steadied_kg
    one = (("gripper", 1.0), ("fingertips", hand.tip_scale))
    for where, (tool, scale) in (*product(("", " at an edge"), one), ("", ("both hands", 1.0))):
        if where and (wide <= hand.opening_m or (miss is not None and miss.fault == "object")):
            continue  # an edge is for what fingers do not get about, not for what opens, or slips out of them
        hands = 2 if tool == "both hands" else 1
        world = open_world(folder, hand, scale, stand_m=STAND_SHARE * wide if where else 0.0, hands=hands)
        set_turned(world)
        world.model.geom_friction[world.tool_geoms, 0] = min(hand.pad_friction, overlay.contact_friction)
        points, _, _ = surface_places(world, body_subtree(world.model, world.root))
        larger = float(np.ptp(points, axis=0).max()) / settings.carried_m if len(points) else 0.0
        if overlay.support.kind is not SupportKind.HANDHELD and max(heavier, larger) > hands:
            continue
        wide = float(np.ptp(points[:, :2], axis=0).min()) if len(points) else 0.0
        share, missed = at_yaws(world, overlay, grasps_of(world, world.root, settings), settings)
        if best.share is None or share > best.share:
            best = Lifted(True, share, tool + where if share else "", missed)
        if share == 1.0:
            break
        miss = miss or missed
    return best


def at_yaws(
    world: HandWorld, overlay: PhysicsOverlay, grasps: list[HandHold], settings: LiftSettings
) -> tuple[float, Miss | None]:
    """The share of the yaws at which one of the grasps did, the one that did at the last first, and why the best did
    not where none did; the first yaw that fails ends it."""
    if not grasps:
        wide = world.tool.opening_m * 100.0
        return 0.0, Miss("hand", f"no grasp of at most {wide:.1f} cm was found at which a hand has room")
    for number in range(settings.yaws):
        misses = []
        for grasp in grasps:
            yaw = 2.0 * math.pi * number / settings.yaws
            misses.append(why_not_lifted(world, overlay, grasp, yaw, settings))
            if misses[-1] is None:
                grasps = [grasp, *(other for other in grasps if other is not grasp)]
                break
        else:
            return number / settings.yaws, misses[0]
    return 1.0, None


def grasps_of(world: HandWorld, root: int, settings: LiftSettings) -> list[HandHold]:
    """The best grasps of the whole object, near its centre of mass or over it, each at another place."""
    bodies, found = body_subtree(world.model, root), list[HandHold]()
    mujoco.mj_forward(world.model, world.data)
    points, normals, owners = surface_places(world, bodies)
    if not len(points):
        return []
    most = world.tool.opening_m - world.tool.room_m
    size = max(float(np.ptp(points, axis=0).max()), 1e-3)
    joint = int(world.model.body_jntadr[root])
    start = float(world.data.qpos[world.model.jnt_qposadr[joint] + 2])
    name = world.model.joint(joint).name.removeprefix(world.prefix)
    still = welded_bodies(world.model, root)
    for part in (still, bodies):  # by what a joint moves where nothing else has such a place
        own = np.flatnonzero(np.isin(owners, [*part]))
        if not len(own):
            continue
        chosen, widths = places_before_back(world, points[own], normals[own], part, most)
        chosen, width = own[chosen], np.zeros(len(points))
        width[chosen] = widths
        off = points[chosen] - normals[chosen] * widths[:, None] / 2.0 - world.data.subtree_com[root]
        wider = widths / most if world.tool.hands == 2 else -widths / most  # flat hands do not pinch a ridge
        score = 0.2 * off[:, 2] / size - np.linalg.norm(off[:, :2], axis=1) / size + 0.2 * wider
        up = Way(name, True, np.array([0.0, 0.0, 1.0]), np.zeros(3), start, start + settings.high_m, part)
        solid, places = solid_of(world, part, points[own]), (points, normals, owners, width)
        holds = holds_with_room(world, up, "grasp", places, (chosen, score), [], solid, np.random.default_rng(0))
        poses = [body_pose(world.data, one.body) @ one.pose for one in holds]
        found = [one for one, pose in zip(holds, poses, strict=True) if meets_first(world, pose, one.half_open_m, part)]
        if found:
            break
    kept: list[HandHold] = []
    for hold in sorted(found, key=lambda hold: -hold.score):
        apart = [np.linalg.norm(one.pose[:3, 3] - hold.pose[:3, 3]) >= APART_M * world.scale for one in kept]
        if len(kept) < settings.grasps and all(apart):
            kept.append(hold)
    return kept


def why_not_lifted(
    world: HandWorld, overlay: PhysicsOverlay, grasp: HandHold, yaw: float, settings: LiftSettings
) -> Miss | None:
    """Why the object at this yaw (rad) was not lifted by this grasp and set down as it was; else None."""
    set_turned(world, yaw)
    root = world.root
    kept = {
        joint.name: (world.position(joint.name), joint.upper - joint.lower)
        for joint in overlay.joints
        if (joint.holds or joint.stiffness > 0.0) and joint.lower is not None and joint.upper is not None
        if joint.upper > joint.lower
    }
    watch = Watch(world, kept)
    wait(watch, REST_S)
    center, up = world.data.subtree_com[root].copy(), world.data.xmat[root].reshape(3, 3)[:, 2].copy()
    pose = body_pose(world.data, grasp.body) @ grasp.pose
    before = pose.copy()
    before[:3, 3] -= CLEAR_M * world.scale * pose[:3, 2]
    world.put(world.data, before, grasp.half_open_m)
    world.grip = grasp.half_open_m
    move_hand(watch, before, pose, world.settings.speed_m_s)
    world.grip = -1.0
    wait(watch, GRIP_S)
    high = pose.copy()
    high[2, 3] += settings.high_m
    move_hand(watch, pose, high, settings.speed_m_s)
    wait(watch, REST_S)
    risen = float(world.data.subtree_com[root, 2] - center[2])
    tilted = object_tilt(world, root, up)
    move_hand(watch, high, pose, settings.speed_m_s)
    wait(watch, PAUSE_S)
    world.grip = min(grasp.half_open_m + world.tool.room_m, world.tool.opening_m / 2.0)
    wait(watch, RELEASE_S)
    move_hand(watch, pose, before, world.settings.speed_m_s)
    world.target[2, 3] += 1.0
    wait(watch, REST_S)
    return miss_of(world, overlay, root, (risen, tilted, object_tilt(world, root, up)), watch, center, settings)


def miss_of(
    world: HandWorld, overlay: PhysicsOverlay, root: int, seen: tuple[float, float, float], watch: Watch,
    center: Array, settings: LiftSettings,
) -> Miss | None:  # fmt: skip
    """The miss of a lift, None where all was as it should be: ``seen`` are the rise, m, and the tilt,
    rad, when lifted, and the tilt when set down."""
    risen, tilted, rested = seen
    weight = 9.81 * overlay.mass_kg
    moved = max(watch.moved, key=lambda name: watch.moved[name], default="")
    left = float(np.linalg.norm(world.data.subtree_com[root] - center))
    if not np.isfinite(world.data.qpos).all():
        return Miss("object", "it flies away")
    if risen < settings.risen_share * settings.high_m:
        if weight > world.most_n:
            return Miss("object", f"it weighs {weight:.0f} N, and the hand lifts {world.most_n:g} N")
        rise = f"{max(risen, 0.0) * 100.0:.0f} of {settings.high_m * 100.0:.0f} cm"
        return Miss("hand", f"it slips or hangs; it rises by {rise}")
    if tilted > settings.tilt_rad:
        return Miss("hand", f"it turns by {math.degrees(tilted):.0f}° in the hand")
    if moved and watch.moved[moved] > world.settings.closed_share:
        return Miss("object", f"'{moved}' goes {watch.moved[moved]:.0%} of its range")
    if watch.most_n > world.settings.pressed_n:
        return Miss("hand", f"a finger presses with {watch.most_n:.0f} N")
    if rested > GuardSettings().tilt_rad or left > GuardSettings().travel_m:
        return Miss("object", f"set down it lies {left * 100.0:.0f} cm away, turned by {math.degrees(rested):.0f}°")
    return None


def set_turned(world: HandWorld, yaw: float = 0.0) -> None:
    """All as written, the object turned by this yaw, rad, and a stand, if any, below its centre of mass."""
    world.reset()
    root = world.root
    turn_object(world, root, yaw)
    if world.model.nmocap:
        world.data.mocap_pos[0, :2] = world.data.subtree_com[root, :2]
        mujoco.mj_forward(world.model, world.data)


def turn_object(world: HandWorld, root: int, yaw: float) -> None:
    """Turn the object about the vertical through the origin."""
    place = int(world.model.jnt_qposadr[world.model.body_jntadr[root]])
    quaternion, turned = np.zeros(4), np.zeros(4)
    mujoco.mju_axisAngle2Quat(quaternion, np.array([0.0, 0.0, 1.0]), yaw)
    mujoco.mju_mulQuat(turned, quaternion, world.data.qpos[place + 3 : place + 7])
    at = np.zeros(3)
    mujoco.mju_rotVecQuat(at, world.data.qpos[place : place + 3], quaternion)
    world.data.qpos[place : place + 3], world.data.qpos[place + 3 : place + 7] = at, turned
    mujoco.mj_forward(world.model, world.data)


def object_tilt(world: HandWorld, root: int, up: Array) -> float:
    """Angle of the object's own upright axis from where it pointed, rad."""
    return math.acos(float(np.clip(world.data.xmat[root].reshape(3, 3)[:, 2] @ up, -1.0, 1.0)))
