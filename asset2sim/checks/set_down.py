"""The support of a written object at rest, from its shapes and masses, and the object set down in the state that is
asked of it, until it rests: how it moved, how it rests and on what."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from asset2sim.assets.urdf.collision_points import collision_points
from asset2sim.assets.urdf.document import parsed_root
from asset2sim.checks.mechanism import Mechanism, poses_at
from asset2sim.checks.watch import Watched, capped_reading, watch
from asset2sim.engines.world import World
from asset2sim.physics.arrays import Array, cross, floats_of
from asset2sim.physics.mass_matrix import GRAVITY_M_S2
from asset2sim.physics.support_polygon import SupportPolygon, standing_on
from schemas.interaction import Stand
from schemas.settings import EngineSettings

Clouds = Mapping[str, Array]
"""Link → (n, 3) points that span its collision shapes, in the link's frame, m."""


def point_clouds(urdf: Path) -> dict[str, Array]:
    """Link → (n, 3) points that span its collision shapes, in the link's frame, m; none for a link without shapes."""
    links = parsed_root(urdf).findall("link")
    clouds = {str(element.get("name")): collision_points(element, urdf.parent) for element in links}
    return {name: points for name, points in clouds.items() if len(points)}


def support_polygon_of(item: Mechanism, clouds: Clouds, up: Array, positions: Mapping[str, float]) -> SupportPolygon:
    """The support at rest on a plane; (3,) ``up`` is the world's in the root's frame, ``positions`` in rad or m."""
    poses = poses_at(item, positions)
    points = np.vstack(
        [np.zeros((0, 3))]
        + [cloud @ poses[name][:3, :3].T + poses[name][:3, 3] for name, cloud in clouds.items() if name in poses]
    )
    mass = sum(body.mass for body in item.bodies.values())
    if not len(points) or mass <= 0.0:
        return standing_on(np.zeros((1, 3)), np.zeros(3), mass, up)
    center = sum(body.mass * (poses[n][:3, :3] @ body.com + poses[n][:3, 3]) for n, body in item.bodies.items()) / mass
    return standing_on(points, np.asarray(center), mass, up)


UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Resting:
    """The object at rest once set down undisturbed: (3,) world up in the frame of ``root_pose``, joint → position (rad
    or m), and the peak speed of its fastest link until then, m/s.

    The perturbed starts are compared with this, not with how it was set down: whether it stays as it is set down is
    the stands check's to say, and it says so once.
    """

    up: Array
    joints: dict[str, float]
    peak_speed: float


@dataclass
class RootMotion:
    """How far the root has moved since the first reading: tilt of its up axis (rad), travel of its centre of mass (m),
    and that point's peak speed from reading to reading (m/s)."""

    world: World
    first: tuple[Array, Rotation] | None = None
    """Centre of mass, and what turns back the root's orientation."""
    last: tuple[float, Array] | None = None
    tilt_rad: float = 0.0
    travel_m: float = 0.0
    speed_m_s: float = 0.0
    turned: Rotation = field(default_factory=Rotation.identity)
    """How the root is turned now from how it was set down."""

    def read(self, time: float) -> bool:
        """Take a reading at ``time`` (s since it was set down); whether the numbers are no longer finite."""
        center, orientation = self.world.root_center(), self.world.root_pose()[1]
        if not (np.isfinite(center).all() and np.isfinite(orientation).all()):
            self.tilt_rad = self.travel_m = self.speed_m_s = np.inf
            return True
        if self.first is None or self.last is None:
            self.first, self.last = (center, Rotation.from_quat(orientation).inv()), (time, center)
            return False
        self.turned = Rotation.from_quat(orientation) * self.first[1]
        self.tilt_rad = max(self.tilt_rad, angle_between(UP, self.turned.apply(UP)))
        self.travel_m = max(self.travel_m, float(np.linalg.norm(center - self.first[0])))
        self.speed_m_s = max(self.speed_m_s, float(np.linalg.norm(center - self.last[1])) / (time - self.last[0]))
        self.last = time, center
        return False


def set_down(
    world: World, item: Mechanism, clouds: Clouds, settings: EngineSettings
) -> tuple[Stand, Resting, SupportPolygon]:
    """Set the object down undisturbed and watch until it rests, for ``settle_s`` at most; how it rests, and on what."""
    world.place(item.start, height_m=settings.drop_height_m)
    motion = RootMotion(world)
    motion.read(0.0)
    placed_up = up_in_root(world)
    seen = watch(world, settings.settle_s, settings, motion.read)
    resting = Resting(up_in_root(world) if seen.finite else placed_up, joints_after(seen, world, item), seen.peak)
    # The root's own frame is upright where it is set down; the pose that an engine gives may be of another frame.
    up = motion.turned.inv().apply(UP)
    support = support_polygon_of(item, clouds, up, resting.joints)
    record = Stand(
        tilt_rad=capped_reading(motion.tilt_rad),
        travel_m=capped_reading(motion.travel_m),
        peak_speed_m_s=capped_reading(motion.speed_m_s),
        seconds=seen.seconds,
        margin_rad=support.margin_rad,
        tip_energy_j=support.mass * GRAVITY_M_S2 * support.rise,
        rest_turn_rad=floats_of(level_turn(up)),
        finite=seen.finite,
    )
    return record, resting, support


def rest_held(world: World, item: Mechanism, settings: EngineSettings) -> Resting:
    """How the joints of an object whose root is held come to rest from its initial state, ``settle_s`` at most."""
    world.place(item.start)
    up = up_in_root(world)
    seen = watch(world, settings.settle_s, settings)
    return Resting(up, joints_after(seen, world, item), seen.peak)


def joints_after(seen: Watched, world: World, item: Mechanism) -> dict[str, float]:
    """Joint → its position now, rad or m; its initial one where a run has lost finite numbers."""
    return dict(zip(world.joint_names, world.positions().tolist(), strict=True)) if seen.finite else dict(item.start)


def up_in_root(world: World) -> Array:
    """(3,) the world's up direction in the root's frame now."""
    _, orientation = world.root_pose()
    up: Array = Rotation.from_quat(orientation).inv().apply(UP)
    return up


def level_turn(up: Array) -> Array:
    """(3,) rotation vector about a level axis that turns the unit vector ``up`` upright, rad."""
    axis = cross(up, UP)
    length = float(np.linalg.norm(axis))
    level = axis / length if length > 1e-9 else np.array([1.0, 0.0, 0.0])
    turn: Array = level * angle_between(up, UP)
    return turn


def angle_between(a: Array, b: Array) -> float:
    """The angle between two unit vectors, rad; exact near zero, where the arc cosine is not."""
    return float(np.arctan2(np.linalg.norm(cross(a, b)), float(a @ b)))
