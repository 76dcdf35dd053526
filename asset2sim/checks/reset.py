"""The reset check: the object starts slightly off its pose, as in reinforcement learning."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from lxml import etree
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from asset2sim.checks.interaction_verdict import hold_bound
from asset2sim.checks.mechanism import Mechanism, collision_points, poses_at, span_of
from asset2sim.checks.watch import capped, watch
from asset2sim.engines.world import World
from asset2sim.physics.arrays import Array, vector
from schemas.base import Vector3
from schemas.interaction import Reset
from schemas.settings import EngineSettings, Thresholds

TETRAHEDRON = ((1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0))

CORNERS = tuple((sign * x, sign * y, sign * z) for x, y, z in TETRAHEDRON for sign in (1.0, -1.0))
"""Signs of a start's shift, each corner followed by its opposite; the tilt has those of the corner three places
further, so that the two differ."""
TILT_CORNER_SHIFT = 3

UP = np.array([0.0, 0.0, 1.0])


def starts(settings: EngineSettings) -> list[tuple[Vector3, Vector3]]:
    """The perturbed starts as (shift, rotation vector), m and rad: every corner of the box of shifts, each with a
    corner of the box of tilts, then the same again half as far, and so on. Nothing is random."""
    found: list[tuple[Vector3, Vector3]] = []
    for index in range(settings.resets):
        share = 0.5 ** (index // len(CORNERS))
        shift = np.array(CORNERS[index % len(CORNERS)]) * share * settings.reset_m
        tilt = np.array(CORNERS[(index + TILT_CORNER_SHIFT) % len(CORNERS)]) * share * settings.reset_rad
        found.append((vector(shift), vector(tilt)))
    return found


@dataclass(frozen=True)
class Resting:
    """The object at rest once set down undisturbed: (3,) world up in the root's frame, joint → position (rad, m).

    Starts are compared with this, not with how it was set down: an object that topples by itself, as a clock with
    rounded feet, or whose lid comes to lie on the floor, does not fail the reset check for that.
    """

    up: Array
    joints: dict[str, float]


def reset(
    world: World,
    item: Mechanism,
    shift: Vector3,
    tilt: Vector3,
    resting: Resting,
    settings: EngineSettings,
    limits: Thresholds,
) -> Reset:
    """Start from one perturbed pose on the plane, free, and watch until it is still, at most ``fall_s``. A shift
    downwards starts it in contact, never inside the plane. Its end is compared with ``resting``."""
    height = settings.drop_height_m + max(0.0, shift[2])
    world.place(item.start, height_m=height, shift_m=(shift[0], shift[1]), tilt_rad=tilt)
    seen = watch(world, settings.fall_s, settings)
    turned, motion, joint = math.pi, 1.0, None
    if seen.finite:
        turned = angle_between(resting.up, up_in_root(world))
        motion, joint = held_motion(item, world, resting, limits)
    return Reset(
        offset_m=shift,
        tilt_rad=tilt,
        peak_speed_m_s=seen.peak,
        final_speed_m_s=seen.final,
        turned_rad=turned,
        joint_motion=capped(motion),
        joint=joint,
        finite=seen.finite,
    )


def rest(world: World, item: Mechanism, settings: EngineSettings) -> Resting:
    """Set the object down undisturbed and let it come to rest, for ``settle_s`` at most."""
    world.place(item.start, height_m=settings.drop_height_m)
    authored = Resting(up_in_root(world), dict(item.start))
    if not watch(world, settings.settle_s, settings).finite:
        return authored
    joints = zip(world.joint_names, world.positions().tolist(), strict=True)
    return Resting(up_in_root(world), dict(joints))


def up_in_root(world: World) -> Array:
    """(3,) the world's up direction in the root's frame now."""
    _, orientation = world.root_pose()
    up: Array = Rotation.from_quat(orientation).inv().apply(UP)
    return up


def angle_between(a: Array, b: Array) -> float:
    """The angle between two unit vectors, rad; exact near zero, where the arc cosine is not."""
    return float(math.atan2(np.linalg.norm(np.cross(a, b)), float(a @ b)))


def held_motion(item: Mechanism, world: World, resting: Resting, limits: Thresholds) -> tuple[float, str | None]:
    """Largest distance of a joint that must hold from its undisturbed rest, as a share of its range, and that joint.

    Motion within the bound of the hold check counts as none: a third of a degree is much of a stapler's range of five.
    """
    now = dict(zip(world.joint_names, world.positions(), strict=True))
    furthest: tuple[float, str | None] = (0.0, None)
    for joint in item.joints:
        lower, upper = span_of(joint)
        if not joint.holds or upper <= lower:
            continue
        moved = abs(float(now[joint.name]) - resting.joints[joint.name])
        if moved > hold_bound(joint, limits) and moved / (upper - lower) > furthest[0]:
            furthest = moved / (upper - lower), joint.name
    return furthest


STANDING_M = 3e-3
"""Height over the lowest point within which points stand on the floor, m: engines' margins, and uneven feet."""


def tipping(urdf: Path, item: Mechanism, up: Array, positions: Mapping[str, float]) -> tuple[float, float]:
    """What tips the object over, at rest with (3,) ``up`` in the root's frame: the least rise of its centre of mass,
    m, and the longest way from under it to an edge of its support, m.

    Over an edge at distance d from under the centre of mass, which is h high, it rises by √(d² + h²) − h. The rise is 0
    where the object stands on less than a triangle, or leans over an edge already.
    """
    poses = poses_at(item, positions)
    links = {str(element.get("name")): element for element in etree.parse(str(urdf)).getroot().findall("link")}
    clouds = [
        points @ poses[name][:3, :3].T + poses[name][:3, 3]
        for name, element in links.items()
        if name in poses and len(points := collision_points(element, urdf.parent))
    ]
    mass = sum(body.mass for body in item.bodies.values())
    if not clouds or mass <= 0.0:
        return 0.0, 0.0
    center = sum(body.mass * (poses[n][:3, :3] @ body.com + poses[n][:3, 3]) for n, body in item.bodies.items()) / mass
    return rise(np.vstack(clouds), np.asarray(center), up)


def rise(points: Array, center: Array, up: Array) -> tuple[float, float]:
    """As ``tipping``, for (n, 3) points and a (3,) centre of mass."""
    heights = points @ up
    floor = float(heights.min())
    across = np.linalg.svd(up[None, :])[2][1:]
    feet, under = points[heights <= floor + STANDING_M] @ across.T, center @ across.T
    try:
        edges = ConvexHull(feet).equations
    except (QhullError, ValueError):
        return 0.0, 0.0
    distances = -(edges[:, :2] @ under + edges[:, 2])
    height = float(center @ up) - floor
    nearest = max(float(distances.min()), 0.0)
    return float(np.hypot(nearest, height) - height), max(float(distances.max()), 0.0)
