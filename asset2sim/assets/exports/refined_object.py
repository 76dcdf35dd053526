"""Input of every export: the refined URDF with its overlay, read once into frozen data that suits any format."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yourdfpy
from scipy.spatial.transform import Rotation

from asset2sim.assets.folder import URDF_NAME
from asset2sim.assets.meshes.load import load_mesh, primitive, scale_vector
from asset2sim.assets.urdf.document import parsed_root
from asset2sim.assets.urdf.read import Dynamics, passing_pairs, read_dynamics, read_urdf, root_of, tree_joint
from asset2sim.assets.urdf.references import find_mesh
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint, apply, link_to_root, parents_first
from schemas.errors import AssetError
from schemas.overlay import PhysicsOverlay
from schemas.vocabulary import FailureMode

MJCF_NAME, USD_NAME = "mobility.xml", "mobility.usda"
SDF_NAME, SDF_CONFIG_NAME = "model.sdf", "model.config"
"""Files of the exports beside the URDF."""
CLEARANCE_M = 0.01
"""Height of a fixed object's lowest point over the floor, m: a room door clears it by that, and must not rub on it."""
NO_DYNAMICS = Dynamics(0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class ExportShape:
    """One collision shape: a mesh file (``file``, relative to the folder, forward slashes, and its (3,) ``scale``), or
    a primitive: ``kind`` and its ``size`` in m (box: three edges; sphere: radius; cylinder along z: radius, length).
    ``to_link`` is the (4, 4) shape-to-link transform, ``points`` (n, 3) its vertices in the link's frame."""

    kind: str
    to_link: Array
    points: Array
    file: str = ""
    scale: Array | None = None
    size: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class ExportBody:
    """One link: mass in kg, centre of mass (3,) and (3, 3) inertia about it in the link's axes, and shapes."""

    name: str
    mass_kg: float
    com: Array
    inertia: Array
    shapes: tuple[ExportShape, ...]


@dataclass(frozen=True, eq=False)
class ExportJoint:
    """One joint, with its place in the tree, its limits and terms; ``lower`` and ``upper`` are None where it has none.
    Effort in N·m or N; ``initial`` in rad or m, 0 for fixed joints."""

    tree: TreeJoint
    lower: float | None
    upper: float | None
    effort: float | None
    dynamics: Dynamics
    initial: float

    @property
    def name(self) -> str:
        """The joint's name."""
        return self.tree.name

    @property
    def moves(self) -> bool:
        """Whether it is not fixed."""
        return self.tree.type != "fixed"

    @property
    def turns(self) -> bool:
        """Whether its position is an angle."""
        return self.tree.type in ("revolute", "continuous")


@dataclass(frozen=True, eq=False)
class ExportObject:
    """A refined object: ``joints`` parents first, ``bodies`` by name; the root of a ``fixed`` one is held."""

    name: str
    folder: Path
    robot: yourdfpy.Robot
    root: str
    bodies: dict[str, ExportBody]
    joints: tuple[ExportJoint, ...]
    contact_friction: float
    rolling_friction_m: float
    fixed: bool = False
    passing: tuple[tuple[str, str], ...] = ()
    """Pairs of links that pass through each other."""

    @property
    def initial(self) -> dict[str, float]:
        """Movable joint → initial position, rad or m."""
        return {joint.name: joint.initial for joint in self.joints if joint.moves}

    def poses(self, positions: Mapping[str, float]) -> dict[str, Array]:
        """Link name → (4, 4) link-to-root transform at these joint positions; joints not named are at zero."""
        return link_to_root([joint.tree for joint in self.joints], self.root, positions)

    def height_to_stand(self, positions: Mapping[str, float]) -> float:
        """How far, m, the upright root must rise to have its lowest collision point at z = 0, or ``CLEARANCE_M`` above
        where it is fixed; 0 where none collides."""
        poses = self.poses(positions)
        shapes = [(poses[body.name], shape.points) for body in self.bodies.values() for shape in body.shapes]
        lowest = [float(apply(pose, points)[:, 2].min()) for pose, points in shapes if len(points)]
        return (CLEARANCE_M if self.fixed else 0.0) - min(lowest) if lowest else 0.0


def read_object(folder: Path, overlay: PhysicsOverlay) -> ExportObject:
    """The refined object in ``folder``; terms and limits as its URDF states them, the state as the overlay does. Raises
    AssetError: what reading the URDF raises, unreadable_asset where a link lacks its inertial, missing_mesh where a
    collision mesh is not there."""
    robot = read_urdf(folder / URDF_NAME)
    dynamics = read_dynamics(folder / URDF_NAME)
    stated = {joint.name: joint for joint in robot.joints}
    tree = parents_first([tree_joint(joint) for joint in robot.joints])
    return ExportObject(
        name=str(robot.name or overlay.asset_id),
        folder=folder,
        robot=robot,
        root=root_of(robot),
        bodies={str(link.name): _body(link, folder) for link in robot.links},
        joints=tuple(_joint(joint, stated[joint.name], dynamics, overlay.initial_positions) for joint in tree),
        contact_friction=overlay.contact_friction,
        rolling_friction_m=overlay.rolling_friction_m,
        fixed=overlay.support.fixed,
        passing=passing_pairs(parsed_root(folder / URDF_NAME)),
    )


def _joint(
    tree: TreeJoint, joint: yourdfpy.Joint, dynamics: Mapping[str, Dynamics], initial: Mapping[str, float]
) -> ExportJoint:
    bounded = joint.limit is not None and joint.type in ("revolute", "prismatic")
    lower, upper = (joint.limit.lower, joint.limit.upper) if bounded else (None, None)
    return ExportJoint(
        tree=tree,
        lower=None if lower is None else float(lower),
        upper=None if upper is None else float(upper),
        effort=None if joint.limit is None or joint.limit.effort is None else float(joint.limit.effort),
        dynamics=dynamics.get(joint.name, NO_DYNAMICS),
        initial=float(initial.get(joint.name, 0.0)) if joint.type != "fixed" else 0.0,
    )


def _body(link: yourdfpy.Link, folder: Path) -> ExportBody:
    inertial = link.inertial
    if inertial is None or not inertial.mass or inertial.inertia is None:
        problem = "has no mass and inertia, so that every simulator would make up its own; refine the asset first"
        message = f"{URDF_NAME}: link '{link.name}' {problem}"
        raise AssetError(FailureMode.UNREADABLE_ASSET, "no_inertial", message, link=str(link.name))
    pose = np.eye(4) if inertial.origin is None else np.asarray(inertial.origin, dtype=float)
    tensor = np.asarray(inertial.inertia, dtype=float)
    tensor = (tensor + tensor.T) / 2.0
    shapes = tuple(_shape(item, str(link.name), folder) for item in link.collisions)
    turned = pose[:3, :3] @ tensor @ pose[:3, :3].T if not np.allclose(pose[:3, :3], np.eye(3), atol=1e-12) else tensor
    return ExportBody(str(link.name), float(inertial.mass), pose[:3, 3].copy(), turned, shapes)


def _shape(collision: yourdfpy.Collision, link: str, folder: Path) -> ExportShape:
    to_link = np.eye(4) if collision.origin is None else np.asarray(collision.origin, dtype=float)
    geometry = collision.geometry
    if geometry.mesh is None:
        mesh = primitive(geometry)
        if mesh is None:
            message = f"{URDF_NAME}: link '{link}' collides with a shape that is no box, cylinder, sphere or mesh"
            raise AssetError(FailureMode.UNREADABLE_ASSET, "unknown_shape", message, link=link)
        kind, size = _primitive(geometry)
        return ExportShape(kind, to_link, apply(to_link, np.asarray(mesh.vertices, dtype=float)), size=size)
    path = find_mesh(geometry.mesh.filename, folder)
    if path is None:
        problem = f"collision mesh '{geometry.mesh.filename}' of link '{link}' is not there; refine it again"
        raise AssetError(FailureMode.MISSING_MESH, "missing_mesh", f"{URDF_NAME}: {problem}", link=link)
    scale = scale_vector(geometry.mesh)
    points = apply(to_link, np.asarray(load_mesh(path).vertices, dtype=float) * scale)
    return ExportShape("mesh", to_link, points, path.resolve().relative_to(folder.resolve()).as_posix(), scale)


def _primitive(geometry: yourdfpy.Geometry) -> tuple[str, tuple[float, ...]]:
    if geometry.box is not None:
        return "box", tuple(float(edge) for edge in geometry.box.size)
    if geometry.cylinder is not None:
        return "cylinder", (float(geometry.cylinder.radius), float(geometry.cylinder.length))
    return "sphere", (float(geometry.sphere.radius),)


def wxyz_of(rotation: Array) -> tuple[float, float, float, float]:
    """The unit quaternion (w, x, y, z), w not negative, of a (3, 3) rotation."""
    x, y, z, w = (float(v) for v in Rotation.from_matrix(rotation).as_quat())
    sign = math.copysign(1.0, w)
    return (sign * w, sign * x, sign * y, sign * z)
