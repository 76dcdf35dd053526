"""One object in one PhysX scene on the CPU.

SAPIEN's own URDF loader leaves friction and stiffness out and makes up masses, so the links are built one by one.
"""

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import yourdfpy

from asset2sim.assets.meshes.load import mesh_points, scale_vector
from asset2sim.assets.urdf.capsule import Capsule
from asset2sim.assets.urdf.document import parsed_root
from asset2sim.assets.urdf.read import Dynamics, passing_pairs, read_dynamics, read_urdf
from asset2sim.assets.urdf.references import find_mesh
from asset2sim.engines import lowest
from asset2sim.engines.console import captured_console
from asset2sim.engines.sapien_joint import UNBOUNDED, Builder, damper_of, give_joint
from asset2sim.engines.world import contact_distance_m
from asset2sim.load.in_sapien import give_treads, meet_treads
from asset2sim.load.shapes import wheels_of
from asset2sim.physics.arrays import Array
from schemas.errors import AssetError
from schemas.vocabulary import FailureMode


def import_physx() -> tuple[ModuleType, ModuleType]:
    """The modules ``sapien`` and ``sapien.physx``; no graphics device is touched."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import sapien
        import sapien.physx

    return sapien, sapien.physx


CONTACT_OFFSET_M = 0.0005
"""Distance of each of the object's shapes from which contacts are foreseen, m. At SAPIEN's 10 mm every part of an
object touches all its neighbours, and a step takes up to fifty times longer."""
TEMPORAL_SOLVER = False
"""PhysX' temporal Gauss-Seidel solver reports speeds of centimetres a second of parts that stand still between a spring
and a limit, and lets joints that friction holds creep; its projected one does neither."""
PERSISTENT_CONTACTS = False
"""PhysX' contacts that persist from step to step have tolerances for bodies of a metre: eyeglasses and bottles shake on
them for ever. Contacts that are found anew in each step also do not depend on the poses before."""
POSITION_ITERATIONS = 50
"""Solver iterations for positions: with SAPIEN's 10 a hinge that friction holds creeps by 0.3 mrad/s where the object
stands on the plane, with 50 not at all."""
VELOCITY_ITERATIONS = 1

FILTER_BITS = 30
"""Kinds of links that PhysX' filter tells apart beside the plane."""
ALONG_X = (0.7071068, 0.0, 0.7071068, 0.0)
"""The turn (wxyz) from URDF's cylinders along z to PhysX' along x."""
UPWARDS = (0.7071068, 0.0, -0.7071068, 0.0)
"""The turn (wxyz) from PhysX' plane, whose normal is x, to one whose normal is z."""


@dataclass(frozen=True)
class SapienItem:
    """A loaded object: PhysX' system and articulation, its links in order with shapes, joints' terms, and its URDF."""

    system: Any
    articulation: Any
    links: tuple[Any, ...]
    cloud: lowest.BallCloud
    dynamics: dict[str, Dynamics]
    console: tuple[str, ...]
    robot: yourdfpy.Robot


@contextmanager
def loaded(
    urdf: Path, *, plane: bool, timestep_s: float, contact_friction: float, gravity_m_s2: float
) -> Iterator[SapienItem]:
    """Load a URDF into a scene of its own; the root is free over a plane, or held without one.

    Raises AssetError: what ``read_urdf`` raises, or engine_crash where a moving link has no mass or PhysX cannot take
    it. A mesh that PhysX cannot make a hull of is left out, as by SAPIEN's loader, with a line on the console.
    """
    sapien, physx = import_physx()
    robot = known_robot(urdf, urdf.read_bytes() if urdf.is_file() else b"")
    with captured_console() as console:
        scene, system = open_scene(sapien, physx, timestep_s, gravity_m_s2)
        material = physx.PhysxMaterial(contact_friction, contact_friction, 0.0)
        builder = Builder(sapien, physx, urdf, material, not plane)
        terms = read_dynamics(urdf)
        try:
            built = build_links(builder, robot, terms)
            give_groups(built, passing_pairs(parsed_root(urdf)))
            links = tuple(link for link, _ in built.links)
            give_treads(sapien, physx, links, wheels_of(parsed_root(urdf), links[0].name), material)
        except RuntimeError as error:
            said = " ".join(str(error).split())[:400]
            message = f"SAPIEN refuses {urdf.name} and says: {said}"
            raise AssetError(FailureMode.ENGINE_REFUSED, "engine_refused", message) from error
        if plane:
            scene.add_entity(ground(sapien, physx, material, timestep_s))
        meet_treads(physx, scene.entities)
        for _, entity in built.links:
            scene.add_entity(entity)
    try:
        printed = (*console, *built.said)
        yield SapienItem(system, links[0].articulation, links, lowest.lowest_cloud(built.shapes), terms, printed, robot)
    finally:
        for entity in list(scene.entities):
            scene.remove_entity(entity)


@lru_cache(maxsize=1)
def known_robot(urdf: Path, content: bytes) -> yourdfpy.Robot:
    """``read_urdf`` of a file that holds ``content``; one asset is loaded several times running. Not to be changed."""
    return read_urdf(urdf)


def open_scene(sapien: Any, physx: Any, timestep_s: float, gravity_m_s2: float) -> tuple[Any, Any]:
    """An empty scene without a renderer. SAPIEN keeps a scene's configuration in globals of the process."""
    scene_config = physx.get_scene_config()
    scene_config.gravity = [0.0, 0.0, -gravity_m_s2]
    scene_config.enable_tgs = TEMPORAL_SOLVER
    scene_config.enable_pcm = PERSISTENT_CONTACTS
    physx.set_scene_config(scene_config)
    body_config = physx.get_body_config()
    # A body asleep would hide that it drifts.
    body_config.sleep_threshold = 0.0
    body_config.solver_position_iterations = POSITION_ITERATIONS
    body_config.solver_velocity_iterations = VELOCITY_ITERATIONS
    physx.set_body_config(body_config)
    shape_config = physx.get_shape_config()
    shape_config.contact_offset = CONTACT_OFFSET_M
    physx.set_shape_config(shape_config)
    system = physx.PhysxCpuSystem()
    scene = sapien.Scene([system])
    scene.set_timestep(timestep_s)
    return scene, system


def ground(sapien: Any, physx: Any, material: Any, timestep_s: float) -> Any:
    """A plane at z = 0."""
    entity, body = sapien.Entity(), physx.PhysxRigidStaticComponent()
    shape = physx.PhysxCollisionShapePlane(material)
    shape.local_pose = sapien.Pose(q=UPWARDS)
    shape.contact_offset = contact_distance_m(timestep_s)
    body.attach(shape)
    entity.add_component(body)
    return entity


@dataclass(frozen=True)
class SapienParts:
    """Links with their entities in topological order, collision shapes by link, and what was left out."""

    links: list[tuple[Any, Any]]
    shapes: list[tuple[int, lowest.Balls, Array]]
    said: list[str]


def build_links(builder: Builder, robot: yourdfpy.Robot, terms: dict[str, Dynamics]) -> SapienParts:
    """Every link with its mass, shapes and joint, parents first."""
    children = {joint.child for joint in robot.joints}
    root = next(link.name for link in robot.links if link.name not in children)
    by_name = {link.name: link for link in robot.links}
    below: dict[str, list[yourdfpy.Joint]] = {}
    for joint in robot.joints:
        below.setdefault(joint.parent, []).append(joint)
    built, made = SapienParts([], [], []), dict[str, Any]()
    waiting: list[tuple[str, yourdfpy.Joint | None]] = [(root, None)]
    while waiting:
        name, joint = waiting.pop()
        link = builder.physx.PhysxArticulationLinkComponent(made[joint.parent] if joint is not None else None)
        link.name = made_name = name
        made[made_name] = link
        entity = builder.sapien.Entity()
        entity.name = name
        entity.add_component(link)
        give_shapes(builder, by_name[name], link, len(built.links), built)
        give_mass(builder, by_name[name], link, needed=joint is not None or not builder.held)
        if joint is None:
            link.joint.type = "fixed" if builder.held else "undefined"
        else:
            give_joint(builder, joint, link, terms)
            damper = damper_of(builder, joint, link, made[joint.parent], terms)
            if damper is not None:
                entity.add_component(damper)
        built.links.append((link, entity))
        waiting.extend((child.child, child) for child in reversed(below.get(name, [])))
    return built


def give_groups(built: SapienParts, passing: Sequence[tuple[str, str]]) -> None:
    """Have these pairs of links pass through each other: links that pass the same others share a bit of PhysX' filter,
    the lowest being the plane's. Of more kinds than there are bits all collide."""
    others: dict[str, set[str]] = {link.name: set() for link, _ in built.links}
    for first, second in passing:
        others[first].add(second)
        others[second].add(first)
    closed = {name: found | {name} if found else found for name, found in others.items()}
    # Links that all pass each other are of one kind if each counts itself, links that pass a third alone if not.
    others = min(others, closed, key=lambda found: len({frozenset(names) for names in found.values()}))
    kinds = list(dict.fromkeys(frozenset(names) for names in others.values()))
    if not passing or len(kinds) > FILTER_BITS:
        return
    members = {kind: {name for name, found in others.items() if found == kind} for kind in kinds}
    for link, _ in built.links:
        own = frozenset(others[link.name])
        met = sum(1 << number for number, kind in enumerate(kinds, 1) if not members[kind] <= own)
        for shape in link.collision_shapes:
            shape.set_collision_groups([1 << (1 + kinds.index(own)), 1 | met, 0, 0])


def give_mass(builder: Builder, link: yourdfpy.Link, body: Any, needed: bool) -> None:
    """Set mass, centre of mass and inertia as authored, and nothing that damps or bounds the body's motion."""
    body.linear_damping = body.angular_damping = 0.0
    body.max_linear_velocity = body.max_angular_velocity = UNBOUNDED
    inertial = link.inertial
    mass = 0.0 if inertial is None or inertial.mass is None else float(inertial.mass)
    tensor = np.zeros((3, 3)) if inertial is None or inertial.inertia is None else np.asarray(inertial.inertia)
    moments, axes = np.linalg.eigh(tensor)
    if mass <= 0.0 or moments[0] <= 0.0:
        if not needed:
            return
        message = f"link '{link.name}' moves and has no positive mass and inertia; give it an inertial"
        raise AssetError(
            FailureMode.ENGINE_REFUSED, "engine_refused", f"{builder.urdf.name}: {message}", link=link.name
        )
    if np.linalg.det(axes) < 0.0:
        axes[:, 2] *= -1.0
    turned = np.eye(4)
    turned[:3, :3] = axes
    origin = np.eye(4) if inertial.origin is None else np.asarray(inertial.origin)
    body.mass = mass
    body.cmass_local_pose = builder.sapien.Pose(origin @ turned)
    body.inertia = moments


def give_shapes(builder: Builder, link: yourdfpy.Link, body: Any, index: int, built: SapienParts) -> None:
    """Attach the link's collision shapes, meshes as their convex hulls."""
    for collision in link.collisions:
        pose = np.eye(4) if collision.origin is None else np.asarray(collision.origin)
        try:
            shape, balls, turn = shape_of(builder, collision.geometry)
        except (RuntimeError, ValueError) as error:
            built.said.append(f"link '{link.name}': a collision shape is left out ({error})")
            continue
        placed = builder.sapien.Pose(pose) * turn
        shape.local_pose = placed
        body.attach(shape)
        built.shapes.append((index, balls, placed.to_transformation_matrix().astype(float)))


def shape_of(builder: Builder, geometry: yourdfpy.Geometry) -> tuple[Any, lowest.Balls, Any]:
    """A PhysX shape, the balls that give its lowest point, and its rotation in the URDF's frame. Raises RuntimeError or
    ValueError where there is none."""
    physx, material, straight = builder.physx, builder.material, builder.sapien.Pose()
    if geometry.box is not None:
        half = np.asarray(geometry.box.size, dtype=float) / 2.0
        return physx.PhysxCollisionShapeBox(half_size=half, material=material), lowest.box(half), straight
    if geometry.sphere is not None:
        radius = float(geometry.sphere.radius)
        return physx.PhysxCollisionShapeSphere(radius=radius, material=material), lowest.sphere(radius), straight
    if isinstance(geometry.cylinder, Capsule):
        radius, half_length = float(geometry.cylinder.radius), float(geometry.cylinder.length) / 2.0
        shape = physx.PhysxCollisionShapeCapsule(radius=radius, half_length=half_length, material=material)
        return shape, lowest.capsule(radius, half_length, 0), builder.sapien.Pose(q=ALONG_X)
    if geometry.cylinder is not None:
        radius, half_length = float(geometry.cylinder.radius), float(geometry.cylinder.length) / 2.0
        shape = physx.PhysxCollisionShapeCylinder(radius=radius, half_length=half_length, material=material)
        return shape, lowest.cylinder(radius, half_length, 0), builder.sapien.Pose(q=ALONG_X)
    if geometry.mesh is None:
        raise ValueError("it is no box, cylinder, sphere or mesh")
    file = find_mesh(geometry.mesh.filename, builder.urdf.parent)
    if file is None:
        raise ValueError(f"{geometry.mesh.filename} is missing")
    points = mesh_points(file) * scale_vector(geometry.mesh)
    shape = physx.PhysxCollisionShapeConvexMesh(vertices=points, scale=np.ones(3), material=material)
    return shape, lowest.corners(np.asarray(shape.vertices, dtype=float)), straight
