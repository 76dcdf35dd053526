"""A refined object in SAPIEN."""

import math
from collections.abc import Mapping
from contextlib import suppress
from itertools import count
from typing import Any

import numpy as np

from asset2sim.load.description import Description
from asset2sim.load.loaded import (
    GRAVITY,
    STOP_DAMPING,
    Contact,
    Loaded,
    Root,
    copied_urdf,
    engine_module,
    free_name,
    pose_matrix,
    three_numbers,
)
from asset2sim.load.shapes import wheels_of

SERIALS = count()
"""Numbers of the objects of a process: parts of one that are held together pass each other, not those of another."""

MEETS_PLANES = 1 << 31
"""The bit of SAPIEN's filter by which a wheel's tread meets planes, and nothing else."""
SUNK = 0.02
"""How far a wheel's cylinder sinks in before it bears, as a share of its radius: its tread bears on a plane. Over less,
small wheels at 0.5 m/s and 240 Hz still roll over its corners."""


def give_treads(sapien: Any, physx: Any, links: Any, wheels: Any, material: Any) -> None:
    """Have the wheels (``wheels_of``) of links roll on planes as round ones. PhysX makes a prism of a cylinder, whose
    corners and whose friction before and behind them brake a cart by a tenth of its weight; balls and capsules roll
    without loss. So the widest capsule in the cylinder, where it is short a ball of its radius, meets planes alone."""
    lying = sapien.Pose(q=[math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0])
    for link in (one for one in links if one.name in wheels):
        for shape in link.collision_shapes:
            if isinstance(shape, physx.PhysxCollisionShapeCylinder):
                shape.rest_offset = -SUNK * shape.radius
        for pose, radius, length in wheels[link.name]:
            half = length / 2.0 - radius
            kind = physx.PhysxCollisionShapeCapsule if half > 0.0 else physx.PhysxCollisionShapeSphere
            tread = kind(radius=radius, material=material, **({"half_length": half} if half > 0.0 else {}))
            tread.local_pose = sapien.Pose(pose) * lying
            tread.set_collision_groups([MEETS_PLANES, 0, 0, 0])
            link.attach(tread)


def meet_treads(physx: Any, entities: Any) -> None:
    """Have the planes among a scene's entities bear the treads of wheels."""
    for body in (part for entity in entities for part in entity.components):
        for shape in body.collision_shapes if isinstance(body, physx.PhysxRigidStaticComponent) else ():
            if isinstance(shape, physx.PhysxCollisionShapePlane):
                first, second, *others = shape.collision_groups
                shape.set_collision_groups([first, second | MEETS_PLANES, *others])


def let_pass(about: Description, links: Any) -> None:
    """Have links that the URDF lets pass, or that fixed joints hold together, pass through each other."""
    serial, marks = next(SERIALS), dict[str, tuple[int, int]]()
    for number, group in enumerate((*about.passing, *about.held_together)):
        for name in group:  # a bit of the third group, and a number of the fourth for each 32 of them
            bits, block = marks.get(name, (0, number // 32))
            marks[name] = bits | (1 << number % 32 if block == number // 32 else 0), block
    for link in (link for link in links if link.name in marks):
        bits, block = marks[link.name]
        for shape in link.collision_shapes:
            shape.set_collision_groups([*shape.collision_groups[:2], bits, (8 * serial + block) % 0x10000])


def articulation_of(scene: Any, loader: Any, path: str) -> Any:
    """The articulation that SAPIEN's loader makes of a URDF; of a URDF without joints, from which ``loader.load`` makes
    none, an articulation of its one link."""
    articulations, actors, _ = loader.parse(path)
    if articulations:
        return articulations[0].build()
    builder = scene.create_articulation_builder()
    link = builder.create_link_builder()
    vars(link).update({key: told for key, told in vars(actors[0]).items() if key != "physx_body_type"})
    return builder.build(fix_root_link=loader.fix_root_link)


class SapienObject(Loaded):
    """The object from SAPIEN's own loader, with looks where the scene can render. A joint's drive, at rest and of
    bounded force, is its dry friction; a second drive between the same links is damper and spring. That pulls a hinge
    by 2 k sin(e / 2), the shorter way round, so ``drive`` adds what it lacks of k e. ``scene`` and ``articulation`` are
    SAPIEN's."""

    engine = "sapien"
    takes = "a Scene", "create_urdf_loader"

    def __init__(self, about: Description, root: Root, into: Any, timestep_s: float) -> None:
        super().__init__(about, root)
        sapien, physx, scene, mu = engine_module("sapien"), engine_module("sapien.physx"), into, about.contact_friction
        if scene is None:
            before, config = physx.get_scene_config(), physx.PhysxSceneConfig()
            config.gravity, config.enable_tgs, config.enable_pcm = GRAVITY, False, False
            physx.set_scene_config(config)  # of the process, until the next
            scene = sapien.Scene([physx.PhysxCpuSystem()])
            physx.set_scene_config(before)
            scene.set_timestep(timestep_s)
            scene.add_ground(0.0, render=False, material=physx.PhysxMaterial(mu, mu, 0.0))
        loader, renders = scene.create_urdf_loader(), False
        loader.fix_root_link = root.fixed
        loader.set_material(mu, mu, 0.0)
        with suppress(RuntimeError):  # SAPIEN's answer where there is none
            renders = scene.get_render_system() is not None
        with copied_urdf(about.urdf, visuals=renders) as path:
            body = articulation_of(scene, loader, path)
        body.sleep_threshold, body.solver_position_iterations = 0.0, 50  # with SAPIEN's 10, held lids creep
        for link in body.links:
            link.linear_damping = link.angular_damping = 0.0
            for shape in link.collision_shapes:
                shape.contact_offset = 5e-4  # at SAPIEN's 10 mm every part touches its neighbours
        wheels, material = wheels_of(about.urdf, about.root), physx.PhysxMaterial(mu, mu, 0.0)
        meet_treads(physx, scene.entities if wheels else ())
        let_pass(about, body.links)
        give_treads(sapien, physx, body.links, wheels, material)
        self.springs = [one for one in about.joints if one.stiffness > 0.0 and one.unit == "rad"]
        for joint in about.joints:
            made, slides, rest = body.find_joint_by_name(joint.name), joint.unit == "m", joint.spring_reference
            made.friction, made.armature = 0.0, np.array([joint.armature], np.float32)
            made.set_drive_property(0.0, STOP_DAMPING if joint.friction > 0.0 else 0.0, joint.friction)
            made.set_drive_velocity_target(0.0)
            if joint.damping > 0.0 or joint.stiffness > 0.0:
                frames = made.parent_link.entity, made.pose_in_parent, made.child_link.entity, made.pose_in_child
                drive = scene.create_drive(*frames)
                (drive.set_drive_property_x if slides else drive.set_drive_property_twist)(
                    joint.stiffness, joint.damping
                )
                turned = [1.0, 0.0, 0.0, 0.0] if slides else [math.cos(rest / 2.0), math.sin(rest / 2.0), 0.0, 0.0]
                drive.set_drive_target(sapien.Pose([rest if slides else 0.0, 0.0, 0.0], turned))
        self.scene, self.articulation, self.sapien = scene, body, sapien
        self.order = [joint.name for joint in body.active_joints]
        self.places = [self.order.index(name) for name in self.joint_names]
        names = [other.name for other in scene.get_all_articulations() if other is not body]
        self.name = free_name(root, about, lambda name: name in names)
        body.name = self.name
        self.write({joint.name: joint.initial_position for joint in about.joints})
        self.place()

    @property
    def timestep_s(self) -> float:
        return float(self.scene.get_timestep())

    def read(self) -> tuple[Any, Any]:
        return self.articulation.qpos[self.places], self.articulation.qvel[self.places]

    def write(self, positions: Mapping[str, float]) -> None:
        found, speeds = self.articulation.qpos.copy(), self.articulation.qvel.copy()
        for name, value in positions.items():
            found[self.order.index(name)], speeds[self.order.index(name)] = value, 0.0
        self.articulation.set_qpos(found.astype(np.float32))
        self.articulation.set_qvel(speeds.astype(np.float32))

    def place(self) -> None:
        self.articulation.set_root_pose(self.sapien.Pose(self.root.position, self.root.wxyz))
        self.articulation.set_root_linear_velocity(np.zeros(3, np.float32))
        self.articulation.set_root_angular_velocity(np.zeros(3, np.float32))

    def advance(self) -> object:
        return self.scene.step()

    def push(self, efforts: Mapping[str, float]) -> None:
        wanted = np.array([efforts.get(name, 0.0) for name in self.order])
        for joint in self.springs:
            place = self.order.index(joint.name)
            off = joint.spring_reference - float(self.articulation.qpos[place])
            wanted[place] += joint.stiffness * (off - 2.0 * math.sin(math.remainder(off, math.tau) / 2.0))
        self.articulation.set_qf(wanted.astype(np.float32))

    def link_poses(self) -> dict[str, np.ndarray]:
        return {link.name: pose_matrix(link.entity_pose.p, link.entity_pose.q) for link in self.articulation.links}

    def contacts(self) -> list[Contact]:
        mine, found = {link.entity.per_scene_id: link.name for link in self.articulation.links}, []
        for contact in self.scene.get_contacts():
            entities = [body.entity for body in contact.bodies]
            names = [mine.get(entity.per_scene_id, entity.name) for entity in entities]
            for one, other in ((0, 1), (1, 0)):
                for touched in contact.points if entities[one].per_scene_id in mine else ():
                    force = float(np.linalg.norm(touched.impulse)) / self.timestep_s
                    if force > 0.0:
                        found.append(Contact(names[one], names[other], three_numbers(touched.position), force))
        return found
