"""One object in one live world: steps, hands, efforts, and what can be read of it. No page is needed."""

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from asset2sim.engines.contacts import penetration
from asset2sim.engines.registry import open_world
from asset2sim.engines.world import World
from asset2sim.physics.arrays import Array
from asset2sim.physics.mass_matrix import GRAVITY_M_S2
from asset2sim.viewer.handles import GROUND, Handle, WorldContact
from asset2sim.viewer.viewed_object import Movable, ViewedObject
from schemas.errors import UsageError
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine

HAND_HZ = 1.5
"""Frequency at which a free part would swing on the hand's spring, Hz: it follows a mouse and does not ring."""
HAND_REACH_M = 0.05
"""How far a hand is drawn away, m, until it moves a joint whose friction, load or spring is larger than that takes."""
HAND_MOST_N = 200.0
"""The most that a hand pulls, N."""
HAND_STEP = 0.1
"""Largest stiffness · Δt² / m of the hand: an explicit spring is unstable from 4 on."""
HAND_DAMPING = 0.7
"""Damping ratio of the hand on a free part."""
CROSSING_S = 0.25
"""Least time in which a nudge would cross a joint's whole range, s, as in the nudge check."""
GONE_M = 1e3
"""A place or speed beyond which an object counts as exploded, m or m/s."""
EDGE = 1e-3
"""Least lever of a hand about a hinge, m."""


class ExplodedError(Exception):
    """The simulation of one object has lost finite numbers; it stands still until it is reset."""


@dataclass(frozen=True)
class PullSpring:
    """A spring between a (3,) ``place`` on a link, in the link's frame, and a ``target`` in the world."""

    link: str
    place: Array
    target: Array
    stiffness_n_m: float
    damping_n_s_m: float


@dataclass(frozen=True)
class Readings:
    """Live numbers of one object: Φ (m), kinetic energy (J), joint speeds (rad/s or m/s), the hand's force (N)."""

    phi_m: float
    kinetic_j: float
    speeds: Mapping[str, float]
    hand_n: float


class LiveObject:
    """A subject in its world. ``gravity_m_s2`` is the magnitude; ``tilt`` leans it."""

    def __init__(self, subject: ViewedObject, world: World, settings: EngineSettings, gravity_m_s2: float) -> None:
        self.subject, self.world, self.settings = subject, world, settings
        self.handle: Handle = handle_of(world)
        self.gravity_m_s2 = gravity_m_s2
        self.masses = self.handle.masses()
        self.joints = {joint.name: joint for joint in subject.joints if joint.name in world.joint_names}
        self.efforts: dict[str, float] = {}
        self.grip: PullSpring | None = None
        self.force = np.zeros(3)
        self.seconds = 0.0
        self.reset()

    def reset(self) -> None:
        """The initial state, upright, nothing applied."""
        self.efforts = {}
        self.release()
        self._place({})

    def drop(self) -> None:
        """Let it fall from the height of the drop check, its joints as they are."""
        self._place(self.positions(), height_m=self.settings.fall_height_m)

    def nudge(self) -> None:
        """Give every joint the speed of the nudge check at once, towards where it has more room."""
        now = self.positions()
        self.world.kick({name: nudge_speed(joint, now[name], self.settings) for name, joint in self.joints.items()})

    def tilt(self, about_x_rad: float, about_y_rad: float) -> None:
        """Lean gravity, as if the ground were turned about its x and y axes."""
        down = np.array([0.0, 0.0, -self.gravity_m_s2])
        self.handle.set_gravity(Rotation.from_rotvec([about_x_rad, about_y_rad, 0.0]).inv().apply(down).tolist())

    def set_position(self, joint: str, position: float) -> None:
        """Put one joint there (rad or m) at rest, the others as they are, the object upright on the ground."""
        if joint in self.joints:
            self._place({**self.positions(), joint: position})

    def set_share(self, joint: str, share: float) -> None:
        """The same at a share (0 to 1) of its range in this object."""
        if joint in self.joints:
            found = self.joints[joint]
            self.set_position(joint, found.lower + share * (found.upper - found.lower))

    def set_effort(self, joint: str, effort: float) -> None:
        """Apply a constant effort (N·m or N) on one joint from now on."""
        if joint in self.joints:
            self.efforts[joint] = effort
            self.world.push(self.efforts)

    def grab(
        self,
        link: str,
        point: Array,
        *,
        stiffness_n_m: float | None = None,
        damping: float | None = None,
        even_n_m: float | None = None,
    ) -> None:
        """Take hold of a link at a (3,) point in the world. Without a stiffness (N/m) and damping (N·s/m) of the
        spring they are those of ``hand``."""
        pose = self.handle.poses()[link]
        stiffness, suits = self.hand(link, point, even_n_m)
        self.grip = PullSpring(
            link,
            pose[:3, :3].T @ (point - pose[:3, 3]),
            np.array(point, dtype=float),
            stiffness if stiffness_n_m is None else stiffness_n_m,
            suits if damping is None else damping,
        )

    def drag(self, target: Array) -> None:
        """Bring the other end of the hand's spring to a (3,) place in the world."""
        if self.grip is not None:
            self.grip = replace(self.grip, target=np.array(target))

    def release(self) -> None:
        """Let go."""
        if self.grip is not None:
            self.handle.pull(self.grip.link, self.grip.target, np.zeros(3))
        self.grip, self.force = None, np.zeros(3)

    def held_at(self) -> Array | None:
        """(3,) place in the world that the hand holds; None without one."""
        if self.grip is None:
            return None
        pose = self.handle.poses()[self.grip.link]
        place: Array = pose[:3, :3] @ self.grip.place + pose[:3, 3]
        return place

    def hand(self, link: str, point: Array, even_n_m: float | None = None) -> tuple[float, float]:
        """Stiffness (N/m) and damping (N·s/m) of a hand there: those of a swing at ``HAND_HZ``, or stiffer where the
        joint needs more force; or, where ``even_n_m`` is stated, that stiffness, with the damping that suits 1 kg,
        whatever is held. Both within what the time step bears."""
        carried = sum(self.masses.get(name, 0.0) for name in self.subject.carried(link))
        moved_by = self.subject.moved_by(link)
        joint = None if moved_by is None else self.joints.get(moved_by.name)
        mass, needed = max(carried, 1e-6) / 4.0, 0.0
        if joint is not None:
            lever = 1.0 if joint.slides else self._lever(joint, link, point)
            mass, needed = max(mass, joint.inertia / lever**2), joint.needed / lever
        suits = max(carried * (2.0 * math.pi * HAND_HZ) ** 2, needed / HAND_REACH_M)
        stiffness = min(suits if even_n_m is None else even_n_m, HAND_STEP * mass / self.world.timestep_s**2)
        damped = mass if even_n_m is None else min(mass, 1.0)
        return stiffness, 2.0 * HAND_DAMPING * math.sqrt(stiffness * damped)

    def step(self, count: int = 1) -> None:
        """Advance by that many time steps. Raises ExplodedError."""
        if self.grip is None:
            self.world.step(count)
        else:
            for _ in range(count):
                self._pull()
                self.world.step()
        self.seconds += count * self.world.timestep_s
        self._check()

    def positions(self) -> dict[str, float]:
        """Joint → position, rad or m."""
        return dict(zip(self.world.joint_names, self.world.positions().tolist(), strict=True))

    def poses(self) -> dict[str, Array]:
        """Link → (4, 4) link-to-world transform."""
        return self.handle.poses()

    def touches(self) -> list[WorldContact]:
        """Contact points of the last step."""
        return self.handle.touches()

    def readings(self) -> Readings:
        """The live numbers."""
        speeds = dict(zip(self.world.joint_names, self.world.velocities().tolist(), strict=True))
        within = [touch for touch in self.handle.touches() if touch.link_b != GROUND]
        hand = float(np.linalg.norm(self.force))
        return Readings(penetration(within), self.handle.kinetic_energy(), speeds, hand)

    def _place(self, positions: Mapping[str, float], height_m: float | None = None) -> None:
        self.seconds = 0.0
        height = self.settings.drop_height_m if height_m is None else height_m
        self.world.place({**self.subject.start, **positions}, height_m=height)
        # Placing takes every effort away.
        self.world.push(self.efforts)

    def _pull(self) -> None:
        held, point = self.grip, self.held_at()
        assert held is not None and point is not None, "only what is held is pulled"
        slowing = held.damping_n_s_m * self.handle.point_velocity(held.link, point)
        force = held.stiffness_n_m * (held.target - point) - slowing
        moved_by = self.subject.moved_by(held.link) if self.subject.in_hand else None
        self.force = force * min(1.0, HAND_MOST_N / max(float(np.linalg.norm(force)), 1e-12))
        # The other hand, on what bears the part, takes what the part's joint hands on.
        self.handle.pull(held.link, point, self.force, None if moved_by is None else moved_by.parent)

    def _lever(self, joint: Movable, link: str, point: Array) -> float:
        """Distance of a point from a hinge's axis, m."""
        frame = self.handle.poses()[joint.tree.child]
        away = np.cross(frame[:3, :3] @ joint.tree.axis, point - frame[:3, 3])
        return max(float(np.linalg.norm(away)), EDGE)

    def _check(self) -> None:
        place, _ = self.world.root_pose()
        numbers = np.concatenate([place, self.world.positions(), self.world.velocities()])
        if not np.isfinite(numbers).all() or np.abs(numbers).max() > GONE_M:
            raise ExplodedError(f"exploded after {self.seconds:.2f} s")


def nudge_speed(joint: Movable, position: float, settings: EngineSettings) -> float:
    """Speed (rad/s or m/s) that a nudge gives a joint at this position: towards where it has more room."""
    fastest = settings.nudge_m_s if joint.slides else settings.nudge_rad_s
    speed = min(fastest, (joint.upper - joint.lower) / CROSSING_S)
    return speed if joint.upper - position >= position - joint.lower else -speed


@contextmanager
def open_live_object(subject: ViewedObject, engine: Engine, settings: EngineSettings) -> Iterator[LiveObject]:
    """The subject in a world of the engine, until the context ends. Raises AssetError where the engine refuses it."""
    with open_world(
        engine,
        subject.urdf,
        plane=not subject.held,
        timestep_s=settings.timestep_s,
        contact_friction=subject.contact_friction,
    ) as world:
        yield LiveObject(subject, world, settings, GRAVITY_M_S2)


def handle_of(world: World) -> Handle:
    """The handle of an opened world. Raises UsageError for an engine that the viewer has none for."""
    if world.engine is Engine.PYBULLET:
        from asset2sim.viewer.handle_pybullet import PyBulletHandle

        return PyBulletHandle(world)
    if world.engine is Engine.MUJOCO:
        from asset2sim.viewer.handle_mujoco import MuJoCoHandle

        return MuJoCoHandle(world)
    raise UsageError(f"the viewer runs pybullet and mujoco, not {world.engine}")
