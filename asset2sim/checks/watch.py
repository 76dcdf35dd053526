"""Run a world and record its peak and final speeds; ends early once nothing moves."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from asset2sim.engines.world import World
from asset2sim.physics.arrays import Array
from schemas.settings import EngineSettings

EVERY_S = 1.0 / 60.0
"""Time between two readings, s: reading all link speeds costs more than a step on an object of a hundred links."""
TURN_FACTOR = 10.0
"""Rotations and joints count as still below this many times the links' bound, rad: a lever arm of a decimetre."""
BEYOND_MEASURE = 1e9
"""Recorded instead of infinity or NaN: larger than any threshold, and still a number in JSON."""


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
        return capped(float(self.peaks.max(initial=0.0)))

    @property
    def final(self) -> float:
        """Final speed of the fastest link, m/s."""
        return capped(float(self.finals.max(initial=0.0)))


def capped(value: float) -> float:
    """The value clipped to ± ``BEYOND_MEASURE``; plus ``BEYOND_MEASURE`` where it is not finite."""
    if not np.isfinite(value):
        return BEYOND_MEASURE
    return float(np.clip(value, -BEYOND_MEASURE, BEYOND_MEASURE))


def watch(
    world: World, seconds: float, settings: EngineSettings, seen: Callable[[float], bool] | None = None
) -> Watched:
    """Run the world for ``seconds``, less once nothing has moved for ``settings.still_s``.

    Nothing has moved where over that time the root moved no further than at ``still_speed``, and its orientation and
    all joints no further than ten times that. ``seen`` is called with the time at each reading; true ends the run.
    """
    stride = reading_stride(world)
    window = max(2, round(settings.still_s / (stride * world.timestep_s)))
    readings: deque[tuple[Array, Array]] = deque(maxlen=window)
    poses: deque[Array] = deque(maxlen=window + 1)
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
        if seen is not None and seen(steps * world.timestep_s):
            break
        if len(poses) > window and np.all(np.ptp(np.array(poses), axis=0) <= bounds):
            break
    finals = np.median([links for links, _ in readings], axis=0) if readings else speeds
    joints = np.median([joints for _, joints in readings], axis=0) if readings else np.abs(world.velocities())
    return Watched(steps * world.timestep_s, peaks, finals, joints, True)


def reading_stride(world: World) -> int:
    """Steps between two readings."""
    return max(1, round(EVERY_S / world.timestep_s))


def pose_vector(world: World) -> Array:
    """(12 + n,) pose of the object: the root's position and rotation matrix, then the joint positions."""
    position, orientation = world.root_pose()
    if not np.isfinite(orientation).all():
        return np.full(12 + len(world.joint_names), np.nan)
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
