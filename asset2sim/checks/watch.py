"""Run a world and record its peak and final speeds; ends early once nothing moves, or all goes on as it does."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from asset2sim.checks.mechanism import Mechanism, span_of
from asset2sim.engines.world import World
from asset2sim.physics.arrays import Array
from schemas.settings import EngineSettings, Thresholds

EVERY_S = 1.0 / 60.0
"""Time between two readings, s: reading all link speeds costs more than a step on an object of a hundred links."""
TURN_FACTOR = 10.0
"""Rotations and joints count as still below this many times the links' bound, rad: a lever arm of a decimetre."""
BEYOND_MEASURE = 1e9
"""Recorded instead of infinity or NaN: larger than any threshold, and still a number in JSON."""
STEADY_SHIFT, STEADY_EXTENT = 1.1, 1.2
"""How much further what goes on as it does may shift from one window to the next, and how much wider swing, than it did
before: what topples doubles its pace from one quarter of a second to the next, whatever its size in a house."""
STEADY_EVERY = 5
"""Readings between two looks at whether all goes on as it does: each costs as much as a reading of a large object."""


@dataclass(frozen=True)
class Harmless:
    """Bounds within which nothing of a run decides: of medians of link speeds (``speed``, m/s) and of changes of the
    pose (``change``, (12 + n,) as in ``pose_vector``)."""

    speed: float
    change: Array


def harmless(world: World, item: Mechanism, settings: EngineSettings, limits: Thresholds) -> Harmless:
    """A share of what decides on a drop or a perturbed start: the speed at its end, how far the root may turn, and a
    joint that must hold may move; where it ends, and what is free to turn, decides nothing."""
    share = settings.steady_share
    joints = dict.fromkeys(world.joint_names, np.inf)
    for joint in item.joints:
        if joint.holds:
            lower, upper = span_of(joint)
            joints[joint.name] = share * limits.reset_joint_share * (upper - lower)
    change = [np.inf] * 3 + [share * limits.reset_turn_rad] * 9 + list(joints.values())
    return Harmless(share * limits.final_speed_m_s, np.array(change))


@dataclass(frozen=True)
class Watched:
    """A run of ``seconds``: (l,) peak and final link speeds, m/s, (n,) final joint speeds, rad/s or m/s, and whether
    every number stayed finite.

    A final speed is the median over the last readings: a part that an engine presses against its stop trembles for
    single steps, at a speed of an acceleration times the step, without going anywhere.
    """

    seconds: float
    peaks: Array
    finals: Array
    joint_finals: Array
    finite: bool

    @property
    def peak(self) -> float:
        """Peak speed of the fastest link, m/s."""
        return capped_reading(float(self.peaks.max(initial=0.0)))

    @property
    def final(self) -> float:
        """Final speed of the fastest link, m/s."""
        return capped_reading(float(self.finals.max(initial=0.0)))


def capped_reading(value: float) -> float:
    """The value clipped to ± ``BEYOND_MEASURE``; plus ``BEYOND_MEASURE`` where it is not finite."""
    if not np.isfinite(value):
        return BEYOND_MEASURE
    return float(np.clip(value, -BEYOND_MEASURE, BEYOND_MEASURE))


def watch(
    world: World,
    seconds: float,
    settings: EngineSettings,
    seen: Callable[[float], bool] | None = None,
    calm: Harmless | None = None,
) -> Watched:
    """Run the world for ``seconds``, less once nothing has moved for ``settings.still_s``, or it goes on as it does
    (``is_steady``) and what it changes until the end is ``calm``.

    Nothing has moved where over that time the root moved no further than at ``still_speed``, and its orientation and
    all joints no further than ten times that. ``seen`` is called with the time at each reading; true ends the run.
    """
    stride = reading_stride(world)
    window = max(2, round(settings.still_s / (stride * world.timestep_s)))
    readings: deque[tuple[Array, Array]] = deque(maxlen=window)
    poses: deque[Array] = deque(maxlen=window + 1)
    longer: deque[tuple[Array, Array]] = deque(maxlen=3 * window)
    speeds = world.link_speeds()
    peaks, steps, bounds = speeds, 0, still_bounds(world, settings)
    poses.append(pose_vector(world))
    while steps * world.timestep_s < seconds - 1e-9:
        world.step(stride)
        steps += stride
        speeds, pose = world.link_speeds(), pose_vector(world)
        if not (np.isfinite(speeds).all() and np.isfinite(pose).all()):
            lost = np.full(len(speeds), np.inf)
            return Watched(steps * world.timestep_s, lost, lost, np.full(len(world.joint_names), np.inf), False)
        peaks = np.maximum(peaks, speeds)
        readings.append((speeds, np.abs(world.velocities())))
        poses.append(pose)
        longer.append((pose, speeds))
        if seen is not None and seen(steps * world.timestep_s):
            break
        # What lies further apart at a window's ends has moved: the whole window is looked at where they are alike.
        alike = len(poses) > window and bool((np.abs(pose - poses[0]) <= bounds).all())
        if alike and np.all(np.ptp(np.array(poses), axis=0) <= bounds):
            break
        due = len(longer) == 3 * window and steps // stride % STEADY_EVERY == 0
        if due and calm is not None and is_steady(longer, bounds, calm, (seconds / world.timestep_s - steps) / stride):
            break
    finals = np.median([links for links, _ in readings], axis=0) if readings else speeds
    joints = np.median([joints for _, joints in readings], axis=0) if readings else np.abs(world.velocities())
    return Watched(steps * world.timestep_s, peaks, finals, joints, True)


def is_steady(readings: Sequence[tuple[Array, Array]], still: Array, calm: Harmless, left: float) -> bool:
    """Whether over three windows of readings (pose, link speeds) all trembles, swings or coasts on as it does: neither
    faster nor wider than before, but for what is ``still``, nor so fast or wide, or with so far to go in the readings
    that are ``left``, that it could decide anything."""
    window = len(readings) // 3
    poses = np.array([pose for pose, _ in readings]).reshape(3, window, -1)
    before, shift = np.abs(np.diff(poses.mean(axis=1), axis=0))
    first, second, extent = np.ptp(poses, axis=1)
    goes_on = np.all(shift <= np.maximum(STEADY_SHIFT * before, still)) and np.all(
        extent <= np.maximum(STEADY_EXTENT * np.maximum(first, second), still)
    )
    if not goes_on or np.any(np.maximum(shift * left / window, extent) > calm.change):
        return False
    speeds = np.array([links for _, links in readings]).reshape(3, window, -1)
    return bool(np.median(speeds, axis=1).max(initial=0.0) <= calm.speed)


def reading_stride(world: World) -> int:
    """Steps between two readings."""
    return max(1, round(EVERY_S / world.timestep_s))


def pose_vector(world: World) -> Array:
    """(12 + n,) pose of the object: the root's position and rotation matrix, then the joint positions."""
    position, orientation = world.root_pose()
    return np.concatenate([position, rotation_of(orientation), world.positions()])


def rotation_of(orientation: Array) -> Array:
    """(9,) rotation matrix of a unit xyzw quaternion, row by row; for one, SciPy takes over twenty times as long."""
    x, y, z, w = orientation.tolist()
    first = (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w))
    second = (2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w))
    third = (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y))
    return np.array(first + second + third)


def still_bounds(world: World, settings: EngineSettings) -> Array:
    """(12 + n,) largest change of each entry of the pose over ``still_s`` that counts as still."""
    least = settings.still_speed * settings.still_s
    return np.array([least] * 3 + [TURN_FACTOR * least] * (9 + len(world.joint_names)))
